"""The plan of a batch: each pair has a challenger, who meets all others equally often."""

from collections import Counter

import pytest

from arena.errors import NothingToPlan
from arena.pairing.plan import Entry, PlanRules, plan
from arena.pairing.rules import make_grid

RATED, NEW = ("ann", "bob", "cid"), ("dot", "eli")
ENTRIES = tuple(
    Entry(scenario=f"place-{place}", contestant=name, picture=f"{place}-{name}")
    for place in range(8)
    for name in RATED + NEW
)


def rules(votes: int) -> PlanRules:
    experts = ("eva", "finn", "gil")
    return PlanRules(
        entries=ENTRIES, experts=experts, votes_per_expert=votes, seed=3, challengers=NEW
    )


def test_pairs_without_a_challenger_are_not_shown_and_the_others_equally_often() -> None:
    made = plan(rules(28))
    met = Counter(frozenset((one.left, one.right)) for one in made.matchups)
    assert len(met) == len(RATED) * len(NEW) + 1
    assert not any(pair <= set(RATED) for pair in met)
    assert set(met.values()) == {12}
    assert made == plan(rules(28))


def test_rated_pairs_that_look_alike_are_not_settled_either() -> None:
    alike = (("place-0", "ann", "bob"), ("place-1", "ann", "dot"))
    grid = make_grid(ENTRIES, alike, NEW)
    assert grid.identical == (("place-1", "ann", "dot"),)
    assert int(grid.showable.sum()) == 7 * 8 - 1


def test_more_votes_than_pairs_with_a_challenger_are_refused() -> None:
    with pytest.raises(NothingToPlan, match="56 different pairs"):
        plan(rules(57))
