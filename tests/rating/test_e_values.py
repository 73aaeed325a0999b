"""Who votes without looking is found; who looks is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from arena.rating.comparisons import LOSS, TIE, WIN, Comparison, Comparisons, FloatArray
from arena.rating.e_values import Bet, Manner, compute_e_values, detection_limit
from tests.rating.votes import named, simulated

PAPER = [1042.0, 1039.0, 1025.0, 1010.0, 1001.0, 990.0, 975.0, 964.0, 954.0]
WIDE = [1150.0, 1080.0, 1020.0, 980.0, 920.0, 850.0]
VOTES = 2700


def voting(votes: Comparisons, expert: int, scores: FloatArray) -> Comparisons:
    """The same votes, but one expert's score is another."""
    return replace(votes, score=np.where(votes.expert == expert, scores, votes.score))


def one(score: float, expert: str, first: str = "a", second: str = "b") -> Comparison:
    return Comparison(first=first, second=second, score=score, expert=expert)


def test_a_bet_worked_out_by_hand() -> None:
    # Of two decided votes of f each contestant won one: a and b are equal, so the first vote of e
    # has a chance of 1/2 for everybody, whatever the error and the slips. By then both bettors
    # have their half coin, and the most they ever have is the whole one.
    found = compute_e_values(named([one(WIN, "f"), one(LOSS, "f"), one(WIN, "e"), one(TIE, "e")]))
    assert found[0].e_value == pytest.approx(1.0)
    assert found[0].votes == 1
    # The others' ratings as good as known, 3 to 1 for a; e votes for b, with a chance of 1/4, by
    # slips 0.05 x 1/2 + 0.95 x 1/4 = 0.2625. The blind bettor gave it 1/2, the swapped one 0.7375:
    # 0.5 (1/2 + 0.7375) / 0.2625 = 2.357. Taste and error bring all chances a little nearer.
    many = [one(WIN, "f")] * 30_000 + [one(LOSS, "f")] * 10_000
    found = compute_e_values(named([*many, one(LOSS, "e")]))
    assert found[0].manner is Manner.SWAPPED
    assert found[0].e_value == pytest.approx(2.357, rel=0.02)


def suspects(found: dict[int, Bet]) -> list[int]:
    return [expert for expert, bet in found.items() if bet.e_value > detection_limit(len(found))]


@pytest.mark.parametrize("elo", [PAPER, WIDE], ids=["paper", "wide"])
def test_honest_experts_are_seldom_suspected(elo: list[float]) -> None:
    studies = [compute_e_values(simulated(elo, VOTES, seed)) for seed in range(40)]
    assert all(len(found) == 9 for found in studies)
    assert sum(bool(suspects(found)) for found in studies) <= 0.05 * len(studies)


def test_small_studies_suspect_nobody_by_chance() -> None:
    studies = [compute_e_values(simulated(WIDE[:4], 60, seed, experts=3)) for seed in range(200)]
    assert sum(bool(suspects(found)) for found in studies) <= 0.05 * len(studies)


def test_a_taste_of_ones_own_is_no_reason_for_suspicion() -> None:
    other = [1080.0, 1150.0, 980.0, 1020.0, 850.0, 920.0]
    for seed in range(10):
        votes, tastes = simulated(WIDE, VOTES, seed), simulated(other, VOTES, seed)
        assert 3 not in suspects(compute_e_values(voting(votes, 3, tastes.score)))


@pytest.mark.parametrize(
    ("scores", "manner"),
    [
        (lambda votes: np.full(len(votes), WIN), Manner.BLIND),
        (lambda votes: np.random.default_rng(99).choice([WIN, LOSS], len(votes)), Manner.BLIND),
        (lambda votes: 1.0 - votes.score, Manner.SWAPPED),
    ],
    ids=["always left", "a coin", "keys swapped"],
)
def test_who_does_not_look_is_found(
    scores: Callable[[Comparisons], FloatArray], manner: Manner
) -> None:
    for seed in range(10):
        votes = simulated(WIDE, 2 * VOTES, seed)
        found = compute_e_values(voting(votes, 3, scores(votes)))
        assert suspects(found) == [3]
        assert found[3].manner is manner


def test_the_larger_number_is_capped() -> None:
    votes = simulated(WIDE, 40_000, 1)
    assert compute_e_values(voting(votes, 3, 1.0 - votes.score))[3].e_value == pytest.approx(1e12)


@pytest.mark.parametrize(
    "votes",
    [
        named([], "a", "b"),
        named([one(TIE, "e"), one(TIE, "f")]),
        named([one(WIN, "e"), one(LOSS, "e")]),
        named([one(WIN, "e"), one(WIN, "f")]),
        named([one(WIN, "e"), one(LOSS, "f"), one(WIN, "e", "c", "d"), one(LOSS, "f", "c", "d")]),
    ],
    ids=["no votes", "ties only", "one expert", "no loss", "two groups"],
)
def test_nothing_is_said_where_the_others_say_too_little(votes: Comparisons) -> None:
    assert compute_e_values(votes) == {}


def test_a_contestant_without_decided_votes_does_not_matter() -> None:
    votes = [one(WIN, "f"), one(LOSS, "f"), one(WIN, "e")]
    assert compute_e_values(named([*votes, one(TIE, "e", "a", "c")])) == compute_e_values(
        named(votes)
    )
