"""Judges that save votes: `python -m bench.judged_votes [STUDIES]`, for docs/rating.md.

Prediction-powered ratings (Angelopoulos et al. 2023, with PPI++'s tuned weight w): the scores of
each pair of contestants are the experts', less w times what a judge model says on the units that
experts voted on, plus w times what it says on all units that it judged. Whatever the judge says,
the ratings estimate the experts'. Clusters are the product's: a judged unit is in its scenario's.

Simulated: nine contestants with the paper's ratings, 9 experts of 40 votes, 50 scenarios, effects
of scenarios 100 and of experts 40 points; in the second world also of single units, which alone
let a judge's answers correlate with votes by 0.6 beyond what ratings say.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from arena.rating import models
from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray, IntArray, count_pairs
from arena.rating.models import ELO_PER_LOGIT, DidNotConverge, Meetings, to_elo
from arena.rating.rules import Unit
from arena.rating.sandwich import design_matrix, estimate_spread, pulls_of_model
from bench.report import table
from bench.worlds import THRESHOLDS, World, chances, paper_ratings

EXPERTS, VOTES, VOTED_SCENARIOS, ALL_SCENARIOS = 9, 40, 50, 200
RATIOS = (1, 5, 20)
"""Judged units by votes; the last ones on scenarios that nobody votes on."""
UNIT_SDS = (0.0, 260.0)
FAMILY = (0, 4, 7)
LEFT, RIGHT = np.triu_indices(9, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Votes, and the gap in points of every unit, (S, P), as the average expert sees it."""

    votes: Comparisons
    pair: IntArray
    gap: FloatArray


def hold_study(rng: np.random.Generator, unit_sd: float, votes_each: int = VOTES) -> Study:
    """Return a study with new experts and scenarios."""
    ratings = paper_ratings()
    seen = ratings + rng.normal(0.0, 100.0, (ALL_SCENARIOS, len(ratings)))
    gap = seen[:, LEFT] - seen[:, RIGHT] + rng.normal(0.0, 1.0, (ALL_SCENARIOS, 36)) * unit_sd
    taste = rng.normal(0.0, 40.0, (EXPERTS, len(ratings)))
    units = [rng.permutation(VOTED_SCENARIOS * 36)[:votes_each] for _ in range(EXPERTS)]
    unit, expert = np.concatenate(units), np.repeat(np.arange(EXPERTS), votes_each)
    scenario, pair = unit // 36, unit % 36
    own = gap[scenario, pair] + taste[expert, LEFT[pair]] - taste[expert, RIGHT[pair]]
    threshold = THRESHOLDS[rng.integers(0, len(THRESHOLDS), EXPERTS)][expert]
    win, loss = chances(own / ELO_PER_LOGIT, threshold)
    drawn = rng.random(len(unit))
    votes = Comparisons(
        names=tuple(f"c{index}" for index in range(len(ratings))),
        first=LEFT[pair],
        second=RIGHT[pair],
        score=np.where(drawn < win, WIN, np.where(drawn < 1.0 - loss, TIE, LOSS)),
        expert=expert,
        scenario=scenario,
    )
    return Study(votes=votes, pair=pair, gap=gap)


Judge = Callable[[FloatArray, np.random.Generator], FloatArray]
"""Its scores (S, P) of all units, by their gaps."""


def _expected(gap: FloatArray) -> FloatArray:
    win, loss = chances(gap / ELO_PER_LOGIT, np.asarray(np.median(THRESHOLDS)))
    return np.asarray(0.5 * (1.0 + win - loss))


def _favour_family(gap: FloatArray, rng: np.random.Generator) -> FloatArray:
    bonus = np.isin(np.arange(9), FAMILY) * 200.0
    return _expected(gap + bonus[LEFT] - bonus[RIGHT])


def _favour_left(gap: FloatArray, rng: np.random.Generator) -> FloatArray:
    return _expected(gap + rng.choice([-200.0, 200.0], gap.shape))


JUDGES: dict[str, Judge] = {
    "agrees": lambda gap, rng: _expected(gap),
    "family": _favour_family,
    "left side": _favour_left,
    "noise": lambda gap, rng: rng.choice([LOSS, TIE, WIN], gap.shape),
    "adversarial": lambda gap, rng: 1.0 - _expected(gap),
}


def rate(
    study: Study, judged: FloatArray, units: IntArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return ratings, half widths (C,), and the tuned weight.

    Args:
        study: Whose votes.
        judged: (S, P) what the judge says of every unit.
        units: Those that count beside the voted ones, as scenario * P + pair.
    """
    votes, counts = study.votes, count_pairs(study.votes)
    met = Meetings(len(votes.names), counts)
    # By pair (P,), for games (G,) of the pairs that met: `place` leads from one to the other.
    place = np.full(36, -1)
    place[study.pair] = counts.pair_of
    units = units[place[units % 36] >= 0]
    pair_of_unit = place[units % 36]
    of_votes, of_units = judged[votes.scenario, study.pair], judged.ravel()[units]
    number = np.bincount(pair_of_unit, minlength=len(counts.low))
    # Where nothing of a pair was judged, the judge says nothing of it.
    is_judged = number > 0
    mean = np.bincount(pair_of_unit, of_units, len(counts.low)) / np.maximum(number, 1)
    beside = np.where(is_judged[counts.pair_of], of_votes - mean[counts.pair_of], 0.0)
    strengths = models.fit(met, counts.games[:, None], counts.scores[:, None])[:, 0]
    surprise = votes.score - models.chances(9, strengths, votes.first, votes.second)[0]
    # PPI++: cov(s, f) / var(f) / (1 + n / N), and 0 where it would take votes away.
    centred = of_units - mean[pair_of_unit]
    slope = float(surprise @ beside) / max(float(beside @ beside), 1e-12)
    weight = min(max(slope / (1.0 + len(votes) / max(len(units), 1)), 0.0), 1.0)
    moved = -weight * np.bincount(counts.pair_of, beside, len(counts.low))
    scores = counts.scores + moved
    strengths = models.fit(met, counts.games[:, None], scores[:, None], start=strengths)[:, 0]
    pulls = pulls_of_model(votes, met, counts.games, strengths)
    surprise = votes.score - models.chances(9, strengths, votes.first, votes.second)[0]
    # A judged unit is a row without information, in its scenario, by an "expert" of its own:
    # clustered both ways it counts in its scenario alone.
    share = (counts.games / np.maximum(number, 1))[pair_of_unit] * weight
    rows = Comparisons(
        names=votes.names,
        first=np.concatenate([votes.first, LEFT[units % 36]]),
        second=np.concatenate([votes.second, RIGHT[units % 36]]),
        score=np.concatenate([votes.score, np.full(len(units), TIE)]),
        expert=np.concatenate([votes.expert, EXPERTS + np.arange(len(units))]),
        scenario=np.concatenate([votes.scenario, units // 36]),
    )
    slopes = np.concatenate([surprise - weight * beside, share * centred])
    information = np.concatenate([pulls.information, np.zeros(len(units))])
    known = type(pulls)(
        votes=rows,
        slopes=design_matrix(rows, slopes, np.empty((len(rows), 0))),
        information=information,
        back=pulls.back,
    )
    return to_elo(strengths), estimate_spread(known, Unit.TWO_WAY).half_widths(), weight


@dataclass(slots=True)
class Found:
    """Sums over studies: intervals that hold, their squared and plain widths, weights."""

    held: float = 0.0
    width: float = 0.0
    square: float = 0.0
    weight: float = 0.0
    studies: int = 0

    def add(self, rated: tuple[FloatArray, FloatArray, float], truth: FloatArray) -> None:
        """Count one study."""
        rating, half, weight = rated
        self.held += float((np.abs(rating - truth) <= half).mean())
        self.width += float(half.mean())
        self.square += float((half**2).mean())
        self.weight += weight
        self.studies += 1


def measure(unit_sd: float, studies: int) -> list[list[str]]:
    """Return the rows of a world."""
    truth = World(ratings=paper_ratings(), scenario_sd=100.0, expert_sd=40.0, side_sd=unit_sd)
    true = truth.truth()
    found = {(judge, ratio): Found() for judge in JUDGES for ratio in RATIOS}
    alone, fourfold, correlations = Found(), Found(), dict.fromkeys(JUDGES, 0.0)
    nobody = np.empty(0, dtype=np.int64)
    for seed in range(studies):
        rng = np.random.default_rng(seed)
        study, more = hold_study(rng, unit_sd), hold_study(rng, unit_sd, 4 * VOTES)
        try:
            human = rate(study, study.gap, nobody)
            many = rate(more, more.gap, nobody)
        except DidNotConverge:
            continue
        alone.add(human, true)
        fourfold.add(many, true)
        by_ratings = _expected((human[0][LEFT] - human[0][RIGHT])[study.pair])
        for name, judge in JUDGES.items():
            said = judge(study.gap, rng)
            of_votes = said[study.votes.scenario, study.pair] - said.mean(axis=0)[study.pair]
            correlations[name] += np.corrcoef(of_votes, study.votes.score - by_ratings)[0, 1]
            for ratio in RATIOS:
                scenarios = VOTED_SCENARIOS if ratio < RATIOS[-1] else ALL_SCENARIOS
                units = rng.permutation(scenarios * 36)[: ratio * EXPERTS * VOTES]
                found[name, ratio].add(rate(study, said, units), true)
    n = alone.studies
    # Squared widths are a + b / n: from n and 4 n votes. Then n' has the width that judges give.
    by_votes = 4.0 / 3.0 * (alone.square - fourfold.square) / n
    rest = alone.square / n - by_votes
    rows = [
        [f"{unit_sd:g}", "none", "", "", "", f"{alone.held / n:.1%}", f"{alone.width / n:.1f}", ""]
    ]
    for (name, ratio), one in found.items():
        saved = 1.0 - (one.square / n - rest) / by_votes
        rows.append(
            [
                *("", name, f"{correlations[name] / n:+.2f}", str(ratio), f"{one.weight / n:.2f}"),
                f"{one.held / n:.1%}",
                f"{one.width / n:.1f} ({one.width / alone.width - 1.0:+.1%})",
                f"{saved:.0%}",
            ]
        )
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", nargs="?", type=int, default=400)
    studies = parser.parse_args().studies
    head = ["units", "judge", "residual correlation", "judged / voted", "weight"]
    rows = [row for unit_sd in UNIT_SDS for row in measure(unit_sd, studies)]
    print(table([*head, "coverage", "half width", "votes saved"], rows))


if __name__ == "__main__":
    main()
