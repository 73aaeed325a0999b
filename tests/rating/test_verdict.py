"""The sentence that a rated table begins with."""

import pytest

from arena.rating.lines import Line
from arena.rating.verdict import by_intervals, verdict


def table(*bounds: tuple[float | None, float | None], **more: list[int]) -> list[Line]:
    """Lines A, B, C and so on with these bounds."""
    return [
        Line(
            name="ABCDEFGHIJ"[place],
            lower=lower,
            upper=upper,
            votes=9,
            **{name: values[place] for name, values in more.items()},  # type: ignore[arg-type]
        )
        for place, (lower, upper) in enumerate(bounds)
    ]


APART = (30.0, 31.0), (20.0, 21.0), (10.0, 11.0), (0.0, 1.0)


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ([], "There are no votes to rate."),
        (table((None, None)), "A has nobody to be compared with."),
        (table(APART[0], APART[1]), "A is better than B with 20 votes."),
        (table(APART[0], APART[0]), "A and B can’t be told apart with 20 votes."),
        (table((None, None), (None, None)), "A and B can’t be told apart with 20 votes."),
        (
            table(*APART),
            "The order is A, then B, then C, then D: all are told apart with 20 votes.",
        ),
        (
            table(APART[0], APART[0], APART[0], APART[1]),
            "A, B and C can’t be told apart with 20 votes; D is worse than all three.",
        ),
        (
            table(APART[0], APART[1], APART[1], APART[3]),
            "A is better than all three others with 20 votes; B and C can’t be told apart; "
            "D is worse than all three.",
        ),
        (
            table((30.0, 40.0), (20.0, 32.0), (10.0, 25.0)),
            "A and B can’t be told apart with 20 votes; C is worse than A.",
        ),
        (
            table(*[APART[0]] * 7, APART[1]),
            "7 of the 8 contestants can’t be told apart with 20 votes; H is worse than all seven.",
        ),
        (table(*[APART[0]] * 7), "The 7 contestants can’t be told apart with 20 votes."),
        (
            table(APART[0], APART[1], APART[0], APART[0], part=[0, 0, 1, 1]),
            "20 votes leave 2 groups that can’t be compared: A is better than B; "
            "C and D can’t be told apart.",
        ),
        (  # A won against all and has no bounds; the ranks say who is below
            table((None, None), APART[1], APART[1], part=[-1, 0, 0], rank=[1, 2, 2]),
            "A is better than both others with 20 votes; B and C can’t be told apart.",
        ),
    ],
)
def test_a_table_in_one_sentence(lines: list[Line], sentence: str) -> None:
    assert verdict(lines, 20, None) == sentence


def test_pairs_that_were_judged_at_once_count_before_intervals() -> None:
    lines = table(APART[0], APART[1])
    assert by_intervals(lines) == [(0, 1)]
    assert verdict(lines, 1, []) == "A and B can’t be told apart with 1 vote."
