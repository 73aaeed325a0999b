"""Voters who see 0.15 m: ratings hardly change when what they can't tell apart is settled."""

from __future__ import annotations

from dataclasses import replace

import pytest

from arena.rating.comparisons import TIE
from augment.scene.modification import Modification
from tests.benchmarks.tolerance import disagreements, judge, rate_each_way, units_of
from tests.scenes import vehicle

RIGHT = Modification(added=(vehicle("Agent2", 20.0, 0.0),))
OFF_M = {"right": 0.0, "near": 0.1, "off": 0.8, "far": 1.6}


def changed(off_m: float) -> Modification:
    (agent,) = RIGHT.added
    return Modification(added=(replace(agent, x_m=agent.x_m + off_m),))


CHANGES = {
    f"place-{number}": {name: changed(off_m + 0.001 * number) for name, off_m in OFF_M.items()}
    for number in range(12)
}
UNITS = units_of(CHANGES, dict.fromkeys(CHANGES, RIGHT))


def test_pairs_settle_where_the_objects_are_within_the_tolerance() -> None:
    assert len(UNITS) == 12 * 6
    assert {(one.first, one.second) for one in UNITS if one.is_alike} == {("near", "right")}
    assert not any(one.is_identical for one in UNITS)
    by_pair = {(one.first, one.second): one.better_m for one in UNITS}
    assert by_pair["far", "off"] == pytest.approx(-0.8)


def test_voters_call_equal_what_they_do_not_see_but_for_lapses() -> None:
    said = judge(UNITS, voters=20, seed=3)
    scores: dict[bool, list[float]] = {True: [], False: []}
    for one, votes in zip(UNITS, said, strict=True):
        scores[one.is_alike] += [vote.score for vote in votes]
    shares = {alike: each.count(TIE) / len(each) for alike, each in scores.items()}
    assert shares[True] > 0.9
    assert shares[False] < 0.05


def test_ratings_with_and_without_them_agree_within_their_intervals() -> None:
    boards = rate_each_way(UNITS, judge(UNITS, voters=6, seed=3))
    votes = [sum(line.votes for line in board.lines) // 2 for board in boards.values()]
    assert votes == [72 * 6, 60 * 6, 72 * 6]
    assert disagreements(boards) == []


def test_a_rating_outside_of_anothers_interval_is_named() -> None:
    votes = judge(UNITS, voters=6, seed=3)
    lies = [[replace(vote, score=1.0 - vote.score) for vote in each] for each in votes]
    one, other = rate_each_way(UNITS, votes), rate_each_way(UNITS, lies)
    found = disagreements({"true": one["all pairs voted on"], "lies": other["all pairs voted on"]})
    assert {line.split(":")[0] for line in found} == {"far", "off", "near", "right"}
