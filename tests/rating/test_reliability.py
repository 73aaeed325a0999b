import krippendorff
import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, share, wilson
from arena.rating.reliability import (
    DifferenceMetric,
    Evidence,
    agreement,
    cohens_kappa,
    evidence_of_repeats,
    evidence_of_votes,
    krippendorff_alpha,
    raters,
    repeat_consistency,
)
from tests.rating.votes import Comparison, named, simulated

NOBODY = np.full((9, 9), np.nan)

tables = st.lists(
    st.tuples(*[st.integers(0, 4)] * 3).filter(lambda row: sum(row) >= 2), min_size=2, max_size=12
)


def judged(*rows: tuple[str, str, float], first: str = "a", second: str = "b") -> Comparisons:
    """(expert, scenario, what a scored) against b."""
    return named(
        [
            Comparison(first=first, second=second, score=score, expert=expert, scenario=scenario)
            for expert, scenario, score in rows
        ]
    )


@given(table=tables)
@pytest.mark.parametrize("metric", DifferenceMetric)
def test_alpha_agrees_with_the_package_krippendorff(
    metric: DifferenceMetric, table: list[tuple[int, int, int]]
) -> None:
    counts = np.array(table)
    ours = krippendorff_alpha(counts, metric)
    if ours is None:
        assert (counts.sum(axis=0) > 0).sum() == 1, "only where all values are alike"
        return
    theirs = krippendorff.alpha(
        value_counts=counts, value_domain=[0, 1, 2], level_of_measurement=metric.value
    )
    assert ours == pytest.approx(theirs, abs=1e-9)


def test_units_with_one_judgement_do_not_count() -> None:
    votes = judged(("e", "s1", WIN), ("f", "s1", WIN), ("e", "s2", LOSS), ("f", "s3", TIE))
    found = agreement(votes, rounds=100, seed=1)
    assert (found.units, found.judgements) == (1, 2)
    assert found.percent.value == 1.0
    assert found.alpha.value is None, "all values are alike"
    assert found.percent.lower is None, "one scenario says nothing about the spread"


def test_ac1_of_a_table_worked_out_by_hand() -> None:
    """Gwet's chance comes from all units, also those that one expert judged alone.

    Of losses, ties and wins these have 1/6, 1/3 and 1/2, so that it is 11/36 for three answers;
    of the two units that are shared one agrees.
    """
    votes = judged(
        *[("e", "s1", WIN), ("f", "s1", WIN), ("e", "s2", WIN), ("f", "s2", LOSS)],
        ("e", "s3", TIE),
    )
    found = agreement(votes, rounds=100, seed=1)
    assert found.ac1.value == pytest.approx((1 / 2 - 11 / 36) / (1 - 11 / 36))


def test_what_one_judge_says_again_is_no_agreement_of_two() -> None:
    again = judged(("e", "s1", WIN), ("e", "s1", WIN), ("e", "s2", LOSS), ("e", "s2", TIE))
    assert agreement(again, rounds=100, seed=1).units == 0
    first = judged(("e", "s1", WIN), ("f", "s1", WIN), ("e", "s2", LOSS), ("f", "s2", WIN))
    more = judged(
        *[("e", "s1", WIN), ("f", "s1", WIN), ("e", "s2", LOSS), ("f", "s2", WIN)],
        *[("e", "s2", WIN), ("f", "s1", LOSS)],
    )
    assert agreement(more, rounds=100, seed=1) == agreement(first, rounds=100, seed=1)


def test_sides_do_not_count_as_disagreement() -> None:
    same = named(
        [
            Comparison(first="a", second="b", score=WIN, expert="e", scenario="s1"),
            Comparison(first="b", second="a", score=LOSS, expert="f", scenario="s1"),
            Comparison(first="a", second="b", score=LOSS, expert="e", scenario="s2"),
            Comparison(first="b", second="a", score=WIN, expert="f", scenario="s2"),
        ]
    )
    assert agreement(same, rounds=100, seed=1).alpha.value == pytest.approx(1.0)


def test_without_shared_units_agreement_is_unknown() -> None:
    found = agreement(judged(("e", "s1", WIN), ("f", "s2", WIN)), rounds=10, seed=1)
    assert (found.alpha.value, found.percent.value, found.units) == (None, None, 0)


def test_votes_by_chance_agree_as_chance_does_and_the_interval_covers_it() -> None:
    found = agreement(simulated([1000.0] * 3, 3000, 1, ties=1 / 3), rounds=500, seed=1)
    assert found.alpha.lower < 0.0 < found.alpha.upper
    assert found.alpha.upper - found.alpha.lower < 0.1


# --- Shares ------------------------------------------------------------------------------------


def test_wilsons_interval_of_a_textbook() -> None:
    # 81 of 263, the example of Newcombe (1998): 0.2553 to 0.3662.
    found = wilson(81, 263)
    assert (found.lower, found.upper) == pytest.approx((0.2553, 0.3662), abs=5e-5)


@pytest.mark.parametrize("of_ten", [(3, 6), (2, 5, 9), (4, 5, 6, 5, 3, 7)])
def test_of_experts_with_as_many_votes_each_it_is_the_t_interval_of_their_shares(
    of_ten: tuple[int, ...],
) -> None:
    experts = np.repeat(np.arange(len(of_ten)), 10)
    hits = np.concatenate([np.arange(10) < one for one in of_ten])
    shares = np.array(of_ten) / 10.0
    lower, upper = scipy.stats.t.interval(
        0.95, len(shares) - 1, loc=shares.mean(), scale=scipy.stats.sem(shares)
    )
    found = share(hits, experts)
    assert found.value == pytest.approx(shares.mean())
    assert (found.lower, found.upper) == pytest.approx((max(lower, 0.0), min(upper, 1.0)))


# --- One expert and the others -----------------------------------------------------------------


def test_the_panel_counts_pace_ties_sides_and_agreement() -> None:
    votes = judged(
        ("e", "s1", WIN),
        ("f", "s1", WIN),
        ("g", "s1", LOSS),
        ("e", "s2", TIE),
        ("f", "s2", TIE),
        ("e", "s3", WIN),
    )
    ms = np.array([900.0, np.nan, np.nan, 1500.0, np.nan, 2000.0])
    first, second, third = raters(votes, ms=ms, without=np.array([[0.5, 0], [0, 0.5], [0, 0]]))
    assert (first.votes, first.median_ms) == (3, 1500.0)
    assert first.fast == pytest.approx(1 / 3)
    assert first.ties == pytest.approx(1 / 3)
    assert first.left.value == 1.0
    assert first.shared == 2
    assert first.agreement.value == pytest.approx(0.75), "1/2 and 1/1"
    assert (first.decided, first.favourites.value) == (2, 1.0)
    assert (second.decided, second.favourites.value) == (1, 0.0)
    assert (second.median_ms, second.fast) == (None, None)
    assert (third.decided, third.favourites.value) == (0, None), "the others call them equal"


def test_an_own_second_judgement_is_not_another_experts() -> None:
    votes = judged(("e", "s1", WIN), ("e", "s1", LOSS))
    (only,) = raters(votes, ms=np.full(2, np.nan), without=NOBODY)
    assert (only.shared, only.agreement.value) == (0, None)


def test_repeats_count_what_stayed_and_what_turned() -> None:
    first, again = np.array([1.0, 1.0, 0.5, 0.0]), np.array([1.0, 0.0, 0.5, 0.5])
    found = repeat_consistency(first, again, np.array([0, 0, 1, 1]))
    assert (found.number, found.same.value, found.reversed.value) == (4, 0.5, 0.25)
    assert found.by_expert == {0: (2, 1), 1: (2, 1)}
    with pytest.raises(ValueError, match="4 votes, 3 repeats"):
        repeat_consistency(first, again[:3], np.zeros(4, dtype=np.int64))


def test_votes_are_held_against_what_the_others_foresee() -> None:
    """Worked out by hand: each vote is foreseen from one vote of the other expert.

    On all scenarios the other has given a one win: 1 / (1 + 3), and on this one (1 + 3 / 4) / 4;
    b has the opposite. The slope is 1 / 0.875, and a vote weighs as much as the other's.
    """
    votes = judged(("e", "s1", WIN), ("f", "s1", WIN))
    found = evidence_of_votes(votes)[0]
    assert (found.gain, found.scale) == pytest.approx((1.0, 1.0))
    assert (found.guessing, found.looking) == pytest.approx((1.0, 1.0 + 0.45**2))
    against = evidence_of_votes(judged(("e", "s1", WIN), ("f", "s1", LOSS)))[0]
    assert (against.gain, against.scale) == (0.0, 0.0), "they do not go together"
    three = judged(*[(e, s, WIN) for e in "efg" for s in ("s1", "s2")], ("h", "s1", LOSS))
    assert evidence_of_votes(three)[3].gain < -1.0


def test_repeats_weigh_by_how_steady_the_others_are() -> None:
    """10 of 10 and 2 of 10 alike, half of the votes ties: chance gives 3 / 8."""
    first, again = np.ones(20), np.array([1.0] * 12 + [0.0] * 8)
    repeats = repeat_consistency(first, again, np.repeat([0, 1], 10))
    steady, other = evidence_of_repeats(repeats, {0: 0.5, 1: 0.5}).values()
    assert steady == Evidence.of_trials(10, 10, looking=3 / 8 + 1.25 / 30, guessing=3 / 8)
    assert other.gain < 0.0 < other.scale
    by_hand = Evidence.of_trials(3, 4, looking=0.9, guessing=0.5)
    weight = np.log(9.0)
    assert (by_hand.gain, by_hand.scale) == pytest.approx((weight, 1.6 * weight))
    assert (by_hand.looking, by_hand.guessing) == pytest.approx((0.36 * weight**2, weight**2))


# --- Two raters --------------------------------------------------------------------------------


def test_kappa_of_a_table_worked_out_by_hand() -> None:
    # 20 times both yes, 5 only the first, 10 only the second, 15 both no: 35 of 50 agree, and
    # 0.5 x 0.6 + 0.5 x 0.4 = 0.5 would by chance: (0.7 - 0.5) / 0.5.
    pairs = [(True, True)] * 20 + [(True, False)] * 5 + [(False, True)] * 10
    pairs += [(False, False)] * 15
    first, second = zip(*pairs, strict=True)
    assert cohens_kappa(first, second) == pytest.approx(0.4)
    assert cohens_kappa([True, False], [True, False]) == 1.0
    assert cohens_kappa([True, False], [False, True]) == -1.0


@pytest.mark.parametrize("same", [[], [True], [False, False]])
def test_where_nobody_ever_differs_there_is_nothing_to_tell(same: list[bool]) -> None:
    assert cohens_kappa(same, same) is None
