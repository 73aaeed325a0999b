"""The sentence that a rated table begins with."""

import pytest

from arena.rating.lines import Line
from arena.rating.verdict import verdict


def table(number: int, *, part: str = "", bounds: bool = True) -> list[Line]:
    """Lines A, B, C and so on."""
    return [
        Line(
            name="ABCDEFGHIJ"[place],
            lower=0.0 if bounds else None,
            votes=9,
            part=int(part.split()[place]) if part else 0,
        )
        for place in range(number)
    ]


@pytest.mark.parametrize(
    ("lines", "apart", "sentence"),
    [
        ([], None, "There are no votes to rate."),
        (table(1, bounds=False), None, "A has nobody to be compared with."),
        (table(2), "AB", "A is better than B with 20 votes."),
        (table(2), "", "A and B can’t be told apart with 20 votes."),
        (table(2, bounds=False), None, "A and B can’t be told apart with 20 votes."),
        (table(2), None, "Who is better is not judged with 20 votes."),
        (
            table(4),
            "AB AC AD BC BD CD",
            "The order is A, then B, then C, then D: all are told apart with 20 votes.",
        ),
        (
            table(4),
            "AD BD CD",
            "A, B and C can’t be told apart with 20 votes; D is worse than all three.",
        ),
        (
            table(4),
            "AB AC AD BD CD",
            "A is better than all three others with 20 votes; B and C can’t be told apart; "
            "D is worse than all three.",
        ),
        (table(3), "AC", "A and B can’t be told apart with 20 votes; C is worse than A."),
        (
            table(8),
            "AH BH CH DH EH FH GH",
            "7 of the 8 contestants can’t be told apart with 20 votes; H is worse than all seven.",
        ),
        (table(7), "", "The 7 contestants can’t be told apart with 20 votes."),
        (
            table(4, part="0 0 1 1"),
            "AB",
            "20 votes leave 2 groups that can’t be compared: A is better than B; "
            "C and D can’t be told apart.",
        ),
        (  # A won against all and has no bounds
            table(3, part="-1 0 0"),
            "AB AC",
            "A is better than both others with 20 votes; B and C can’t be told apart.",
        ),
    ],
)
def test_a_table_in_one_sentence(lines: list[Line], apart: str | None, sentence: str) -> None:
    assert verdict(lines, 20, places(apart)) == sentence


@pytest.mark.parametrize(
    ("apart", "sentence"),
    [
        ("AB AC", "A seems better than both others with 1 vote; B and C can’t be told apart."),
        ("AC", "A and B can’t be told apart with 1 vote; C seems worse than A."),
        ("AB AC BC", "The order seems to be A, then B, then C with 1 vote."),
    ],
)
def test_what_rests_on_few_only_seems_so(apart: str, sentence: str) -> None:
    assert verdict(table(3), 1, places(apart), is_few=True) == sentence


def places(apart: str | None) -> list[tuple[int, int]] | None:
    """The pairs of letters as places."""
    if apart is None:
        return None
    return [("ABCDEFGHIJ".index(pair[0]), "ABCDEFGHIJ".index(pair[1])) for pair in apart.split()]
