"""Pairs that nobody can tell apart: a tenth is shown, the others count as if they had been."""

from collections import Counter

from arena.pairing.rules import Entry, draw_shown, draw_ties

ALIKE = [(f"place-{number}", "ann", "bob") for number in range(400)]


def entries(identical: int = 0) -> list[Entry]:
    return [
        Entry(
            scenario=place, contestant=name, picture="same" if n < identical else f"{place}{name}"
        )
        for n, (place, *names) in enumerate(ALIKE)
        for name in names
    ]


def test_a_tenth_of_those_that_differ_at_all_is_shown() -> None:
    shown = draw_shown(ALIKE, entries(identical=100), seed=3)
    assert len(set(shown)) == 30
    assert set(shown) <= set(ALIKE[100:])
    assert shown == draw_shown(ALIKE[::-1], entries(identical=100), seed=3)
    assert shown != draw_shown(ALIKE, entries(identical=100), seed=4)


def test_each_has_as_many_ties_as_a_pair_has_votes_by_different_judges() -> None:
    votes = {"eva": 600, "finn": 300, "gus": 100}
    ties = draw_ties(ALIKE, votes, showable=800, seed=1)  # 1.25 votes a pair
    of_pair = Counter(triple for triple, _ in ties)
    assert set(of_pair) == set(ALIKE)
    assert set(of_pair.values()) == {1, 2}
    assert abs(len(ties) - 500) < 30
    assert len(set(ties)) == len(ties)
    shares = Counter(judge for _, judge in ties)
    assert shares["eva"] > 1.4 * shares["finn"] > 2.0 * shares["gus"]


def test_without_votes_there_are_no_ties() -> None:
    assert draw_ties(ALIKE, {}, showable=800, seed=1) == []
