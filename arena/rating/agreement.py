"""Agreement of metrics and raters with experts, beside the experts' own and a coin's.

In: votes on pairs of augmentations, and raters that prefer one of two augmentations. Out: for each
rater the share of the decided votes with which it agrees, with an interval.

A vote is decided where it names a better side. A rater that calls both equal agrees by half, as in
the concordance index (F. Harrell and others, Evaluating the yield of medical tests, JAMA 1982) and
in Somers' d: guessing then comes to a half, however often a rater ties. Votes on pairs of which a
rater knows nothing are left out of its share and counted.

Notation: V votes, U pairs of augmentations.
"""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import expit, logit

from arena.rating.comparisons import BoolArray, Estimate, FloatArray, IntArray, t_quantile, wilson
from arena.rating.lines import whole_percent
from arena.rating.sandwich import LEAST

_NOTHING = 1e-12
"""Up to which variance all clusters have the same share, but for rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairVote:
    """Expert's vote on two augmentations.

    Attributes:
        judge: Who said it.
        item: The scenario, and `type` its type.
        left, right: Codes of augmentations.
        preference: 1 where the left one is better, 0 for a tie, -1 where the right one is.
    """

    judge: str
    item: str
    type: str
    left: str
    right: str
    preference: int


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedRater:
    """Rater that prefers one of two augmentations.

    Attributes:
        prefers: Takes two codes; 1 where the first is better, 0 for a tie, -1 where the second
            is, None where nothing is known.
    """

    name: str
    prefers: Callable[[str, str], int | None]


def rater_by_scores(
    name: str, scores: Mapping[str, float], *, tolerance: float = 0.0
) -> NamedRater:
    """Return a rater by a score of each augmentation; more is better.

    Args:
        name: Of the rater.
        scores: By code.
        tolerance: Scores that differ by no more are equal.
    """

    def prefers(left: str, other: str) -> int | None:
        if left not in scores or other not in scores:
            return None
        first, second = scores[left], scores[other]
        if first == second or abs(first - second) <= tolerance:  # both may be infinite
            return 0
        return 1 if first > second else -1

    return NamedRater(name=name, prefers=prefers)


def rater_by_pairs(name: str, preferences: Mapping[tuple[str, str], int]) -> NamedRater:
    """Return a rater by its preference for each pair, in either order of the two."""

    def prefers(first: str, other: str) -> int | None:
        if (first, other) in preferences:
            return preferences[first, other]
        back = preferences.get((other, first))
        return None if back is None else -back

    return NamedRater(name=name, prefers=prefers)


class LineRole(StrEnum):
    """Role of a line: a measured rater, or a reference for the others."""

    EXPERTS = "experts"
    RATER = "rater"
    COIN = "coin"


@dataclass(frozen=True, slots=True, kw_only=True)
class AgreementLine:
    """Agreement of one rater with the decided votes.

    Attributes:
        question: What the experts were asked, empty where nobody says.
        type: The scenario type of the votes, empty for all of them.
        share: From 0 to 1, a tie of the rater as a half, with an interval clustered by expert and
            scenario.
        agrees, ties, differs: How many votes that share is made of; for the experts among each
            other the means over the others who judged the same pair, rounded.
        unknown: Votes of which the rater knows nothing.
        experts, scenarios: Among the votes that it knows of.
    """

    rater: str
    role: LineRole = LineRole.RATER
    question: str = ""
    type: str = ""
    share: Estimate
    agrees: int
    ties: int
    differs: int
    unknown: int
    experts: int
    scenarios: int

    @property
    def known(self) -> int:
        """Votes that the share is made of."""
        return self.agrees + self.ties + self.differs

    @property
    def decided(self) -> int:
        """All decided votes."""
        return self.known + self.unknown


EXPERTS_NAME, COIN_NAME = "Experts with each other", "A coin"


def measure_agreement(
    votes: Sequence[PairVote], raters: Sequence[NamedRater]
) -> tuple[AgreementLine, ...]:
    """Measure every rater on all decided votes, then on those of each scenario type.

    Args:
        votes: Ties among them count only as what other experts say of a pair.
        raters: Those that know no decided pair are left out.

    Returns:
        The experts with each other, the raters from the best on all votes down, a coin; then all
        but the coin by type, if there are several. Nothing without decided votes.
    """
    if not any(vote.preference for vote in votes):
        return ()
    numbered = _number(votes)
    opinions = [
        (EXPERTS_NAME, LineRole.EXPERTS, *_other_experts(numbered)),
        *((rater.name, LineRole.RATER, *_opinion(numbered, rater)) for rater in raters),
        (COIN_NAME, LineRole.COIN, np.zeros(len(votes)), np.zeros(len(votes))),
    ]
    lines = [_line(numbered, *opinion) for opinion in opinions]
    measured = [
        (line, opinion)
        for line, opinion in zip(lines, opinions, strict=True)
        if line.known or line.role is not LineRole.RATER
    ]
    order = list(LineRole)
    measured.sort(key=lambda pair: (order.index(pair[0].role), -(pair[0].share.value or 0.0)))
    types = list(dict.fromkeys(vote.type for vote in votes))
    of_types = [
        _line(numbered, *opinion, scenario_type=name)
        for name in (types if len(types) > 1 else ())
        for line, opinion in measured
        if line.role is not LineRole.COIN
    ]
    return (*(line for line, _ in measured), *of_types)


def agreement_sentence(lines: Sequence[AgreementLine]) -> str:
    """Say in one sentence which rater agrees best, beside experts and a coin."""
    whole = [line for line in lines if not line.type]
    best = next((line for line in whole if line.role is LineRole.RATER), None)
    if best is None:
        return "No metric has a value for what was decided."
    experts = next(line for line in whole if line.role is LineRole.EXPERTS)
    among = (
        "how far experts agree with each other is unknown, nobody judged the same pair"
        if experts.share.value is None
        else f"experts agree with each other on {whole_percent(experts.share.value)} %"
    )
    return (
        f"Closest to the experts: {best.rater}, in agreement on {share_text(best.share)} of "
        f"{best.known} decided votes; {among}; a coin on 50 %."
    )


def share_text(share: Estimate) -> str:
    """Return a share in percent, with its interval if there is one: 78 % (71 to 84)."""
    if share.value is None:
        return "unknown"
    text = f"{whole_percent(share.value)} %"
    if share.lower is None or share.upper is None:
        return text
    return f"{text} ({whole_percent(share.lower)} to {whole_percent(share.upper)})"


def two_way_share(hits: FloatArray, expert: IntArray, scenario: IntArray) -> Estimate:
    """Return a mean of hits with a 95 % interval clustered by expert and by scenario.

    The variance is V(experts) + V(scenarios) - V(cells), each with G / (G - 1) for its G clusters
    (A. C. Cameron, J. B. Gelbach, D. L. Miller, Robust inference with multiway clustering, 2011);
    the interval is symmetric in the logit, with Student's t of one degree less than there are
    clusters of the fewer kind. Without a hit, or without a miss, it is Wilson's interval of as
    many votes as there are clusters of the fewer kind. A side with one cluster says nothing,
    nor do clusters that all have the same share.

    Args:
        hits: (V,) from 0 to 1.
        expert: (V,) whose vote each is.
        scenario: (V,) on what.
    """
    if not len(hits):
        return Estimate(value=None)
    value = float(hits.mean())
    # One expert on one scenario: in both kinds of clusters, so taken off once.
    of_cells, _ = _variance(hits, expert * (scenario.max() + 1) + scenario)
    sides = [_variance(hits, of) for of in (expert, scenario) if len(np.unique(of)) > 1]
    fewest = min((clusters for _, clusters in sides), default=1)
    if fewest > 1 and value in (0.0, 1.0):
        return wilson(round(value) * fewest, fewest)
    variance = sum(of_side for of_side, _ in sides) - of_cells * (len(sides) - 1)
    variance = max(variance, LEAST * of_cells)
    if fewest == 1 or variance < _NOTHING:
        return Estimate(value=value)
    # The derivative of the logit of p is 1 / (p (1 - p)).
    half = float(t_quantile(fewest - 1)) * math.sqrt(variance) / (value * (1.0 - value))
    middle = float(logit(value))
    lower, upper = expit([middle - half, middle + half]).tolist()
    return Estimate(value=value, lower=lower, upper=upper)


# --- Private -------------------------------------------------------------------------------------


def _variance(hits: FloatArray, cluster_of: IntArray) -> tuple[float, int]:
    """The variance of a mean, and the number of clusters."""
    _, cluster_of = np.unique(cluster_of, return_inverse=True)
    # (G,) hits above the mean, added up before they are squared.
    sums = np.bincount(cluster_of, weights=hits - hits.mean())
    clusters = len(sums)
    return float((sums**2).sum()) * clusters / max(clusters - 1, 1) / len(hits) ** 2, clusters


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _NumberedVotes:
    """Votes as numbers.

    Attributes:
        pairs: (U) codes of two augmentations, in their order.
        pair_of, expert, scenario: (V,) integers from 0.
        sign: (V,) 1 where the pair's first is better, 0, or -1.
        types: (V,) of scenarios.
    """

    pairs: list[tuple[str, str]]
    pair_of: IntArray
    expert: IntArray
    scenario: IntArray
    sign: FloatArray
    types: list[str]


def _number(votes: Sequence[PairVote]) -> _NumberedVotes:
    pairs = [(min(vote.left, vote.right), max(vote.left, vote.right)) for vote in votes]
    signs = [vote.preference if vote.left <= vote.right else -vote.preference for vote in votes]
    return _NumberedVotes(
        pairs=list(dict.fromkeys(pairs)),
        pair_of=_places(pairs),
        expert=_places([vote.judge for vote in votes]),
        scenario=_places([vote.item for vote in votes]),
        sign=np.array(signs, dtype=np.float64),
        types=[vote.type for vote in votes],
    )


def _places(names: Sequence[Hashable]) -> IntArray:
    """Number names in the order in which they first appear."""
    place_of = {name: place for place, name in enumerate(dict.fromkeys(names))}
    return np.array([place_of[name] for name in names], dtype=np.int64)


def _opinion(votes: _NumberedVotes, rater: NamedRater) -> tuple[FloatArray, FloatArray]:
    """(V,) what a rater prefers in each vote's pair, not a number if unknown; (V,) its ties."""
    opinions = [rater.prefers(*pair) for pair in votes.pairs]
    lean = np.array(
        [np.nan if opinion is None else opinion for opinion in opinions], dtype=np.float64
    )
    # (U,) opinions on pairs become (V,), one for each vote.
    lean = lean[votes.pair_of]
    return lean, np.asarray(lean == 0.0, dtype=np.float64)


def _other_experts(votes: _NumberedVotes) -> tuple[FloatArray, FloatArray]:
    """(V,) the mean of what the other experts prefer in each vote's pair, and of their ties."""
    # The expert's own votes on a pair, which are taken off all votes on it.
    own = votes.pair_of * (int(votes.expert.max()) + 1) + votes.expert
    _, own = np.unique(own, return_inverse=True)

    def of_others(values: FloatArray) -> FloatArray:
        totals = [np.bincount(key, weights=values)[key] for key in (votes.pair_of, own)]
        return np.asarray(totals[0] - totals[1])

    others = of_others(np.ones(len(own)))
    # 0 / 0 where nobody else judged the pair: not a number, which is unknown.
    with np.errstate(invalid="ignore"):
        return (
            np.asarray(of_others(votes.sign) / others),
            np.asarray(of_others(np.asarray(votes.sign == 0.0, dtype=np.float64)) / others),
        )


def _line(
    votes: _NumberedVotes,
    name: str,
    role: LineRole,
    lean: FloatArray,
    tied: FloatArray,
    *,
    scenario_type: str = "",
) -> AgreementLine:
    is_asked: BoolArray = votes.sign != 0.0
    if scenario_type:
        is_asked &= np.array(votes.types) == scenario_type
    is_known = is_asked & ~np.isnan(lean)
    # 1 where both name the same, 1/2 for a tie, 0 for the opposite; means lie between.
    hits = 0.5 + 0.5 * votes.sign[is_known] * lean[is_known]
    expert, scenario = votes.expert[is_known], votes.scenario[is_known]
    ties = round(float(tied[is_known].sum()))
    if role is LineRole.COIN:
        share, ties = Estimate(value=0.5), 0
    else:
        share = two_way_share(hits, expert, scenario)
    agrees = round(float(hits.sum()) - 0.5 * float(tied[is_known].sum()))
    return AgreementLine(
        rater=name,
        role=role,
        type=scenario_type,
        share=share,
        agrees=agrees,
        ties=ties,
        differs=int(is_known.sum()) - agrees - ties,
        unknown=int(is_asked.sum() - is_known.sum()),
        experts=len(np.unique(expert)),
        scenarios=len(np.unique(scenario)),
    )
