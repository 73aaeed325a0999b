"""Which rater agrees with experts: shares counted by hand, and intervals that hold."""

import numpy as np
import pytest

from arena.rating.agreement import (
    AgreementLine,
    PairVote,
    agreement_sentence,
    measure_agreement,
    rater_by_pairs,
    rater_by_scores,
    two_way_share,
)


def said(judge: str, item: str, left: str, right: str, preference: int) -> PairVote:
    """What a judge says of two augmentations; the type is the item's first letter."""
    return PairVote(
        judge=judge, item=item, type=item[0], left=left, right=right, preference=preference
    )


VOTES = (
    said("eva", "n1", "a", "b", 1),
    said("finn", "n1", "b", "a", -1),
    said("gus", "n1", "a", "b", -1),
    said("eva", "n2", "c", "d", 1),
    said("finn", "n2", "c", "d", 0),
    said("eva", "j1", "e", "f", -1),
)
"""Five decided votes. Of the others on the same pair: eva's and finn's of n1 agree by a half,
gus's by nothing, and eva's of n2 meets a tie; nobody else judged the pair of j1."""


def line_of(lines: tuple[AgreementLine, ...], rater: str, of_type: str = "") -> AgreementLine:
    return next(line for line in lines if (line.rater, line.type) == (rater, of_type))


def share_of(line: AgreementLine) -> float:
    return round(line.share.value, 9)


def counts(line: AgreementLine) -> tuple[float, int, int, int, int]:
    return share_of(line), line.agrees, line.ties, line.differs, line.unknown


def test_shares_are_those_counted_by_hand() -> None:
    scores = rater_by_scores("score", {"a": 3.0, "b": 1.0, "c": 1.0, "d": 1.1}, tolerance=0.2)
    judge = rater_by_pairs("judge", {("b", "a"): 1, ("c", "d"): 1, ("f", "e"): -1})
    lines = measure_agreement(VOTES, [scores, judge, rater_by_scores("blind", {"x": 1.0})])
    assert [line.rater for line in lines if not line.type] == [
        *("Experts with each other", "score", "judge", "A coin")
    ]
    # eva and finn are right of n1, gus is not; n2 is a tie; nothing is known of j1.
    assert counts(line_of(lines, "score")) == (2.5 / 4, 2, 1, 1, 1)
    # Only gus and eva's n2; of j1 the judge prefers e, eva f.
    assert counts(line_of(lines, "judge")) == (2 / 5, 2, 0, 3, 0)
    # 1/2 + 1/2 + 0 on n1, 1/2 on n2.
    experts = line_of(lines, "Experts with each other")
    assert (share_of(experts), experts.known, experts.unknown) == (1.5 / 4, 4, 1)
    assert line_of(lines, "A coin").share.value == 0.5
    assert counts(line_of(lines, "judge", "j"))[1:] == (0, 0, 1, 0)
    assert (experts.experts, experts.scenarios) == (3, 2)


def test_the_sentence_names_the_best_the_experts_and_the_floor() -> None:
    scores = rater_by_scores("Checks", {"a": 2.0, "b": 1.0})
    assert agreement_sentence(measure_agreement(VOTES, [scores])) == (
        "Closest to the experts: Checks, in agreement on 67 % (0 to 100) of 3 decided votes; "
        "experts agree with each other on 38 %; a coin on 50 %."
    )
    alone = measure_agreement(VOTES[-1:], [])
    assert agreement_sentence(alone) == "No metric has a value for what was decided."
    assert "unknown, nobody judged the same pair" in agreement_sentence(
        measure_agreement(VOTES[-1:], [rater_by_scores("Checks", {"e": -np.inf, "f": -np.inf})])
    )


def test_without_a_decided_vote_there_is_nothing_to_agree_with() -> None:
    assert measure_agreement([VOTES[4]], [rater_by_scores("score", {})]) == ()


@pytest.mark.parametrize(
    ("hits", "experts", "bounded"),
    [
        ([1.0] * 6, [0, 0, 1, 1, 2, 2], True),
        ([1.0, 0.0], [0, 0], False),
        ([0.5] * 4, [0] * 4, False),
        ([1.0, 1.0, 0.0] * 2, [0, 0, 0, 1, 1, 1], False),
    ],
    ids=["all agree", "one expert on one scenario", "ties alone", "two experts alike"],
)
def test_an_interval_is_missing_where_nothing_bounds_it(
    hits: list[float], experts: list[int], bounded: bool
) -> None:
    expert = np.array(experts)
    found = two_way_share(np.array(hits), expert, expert)
    assert (found.lower is not None) is bounded
    if bounded:  # Wilson's interval of three votes
        assert found.lower == pytest.approx(0.4385, abs=1e-4)
        assert found.upper == 1.0


@pytest.mark.parametrize("effects", [(0.0, 0.0), (0.3, 0.7)], ids=["alike", "differing"])
def test_intervals_hold_the_truth(effects: tuple[float, float]) -> None:
    """Nine experts and fifty scenarios: 300 simulated studies of 500 votes."""
    odds = np.log(4.0)
    many = np.random.default_rng(0).normal(odds, np.hypot(*effects), 200_000)
    truth = float((1.0 / (1.0 + np.exp(-many))).mean())
    held = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        expert, scenario = rng.integers(0, 9, 500), rng.integers(0, 50, 500)
        of_expert, of_scenario = (
            rng.normal(0.0, sd, size) for sd, size in zip(effects, (9, 50), strict=True)
        )
        chance = 1.0 / (1.0 + np.exp(-odds - of_expert[expert] - of_scenario[scenario]))
        hits = np.asarray(rng.random(500) < chance, dtype=np.float64)
        found = two_way_share(hits, expert, scenario)
        held += found.lower <= truth <= found.upper
    assert 0.92 <= held / 300 <= 0.99
