"""The paper's table of ratings, and votes simulated so that they could have led to it."""

import json
from pathlib import Path

import numpy as np

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray, IntArray
from arena.rating.models import ELO_PER_LOGIT

ROWS = json.loads((Path(__file__).parent / "paper_table.json").read_text())["rows"]
NAMES = tuple(row[0] for row in ROWS)
RANKS, ELO, MINUS, PLUS, VOTES = (
    np.array([row[column] for row in ROWS], dtype=np.float64) for column in range(1, 6)
)
TIE_SHARE = 0.6


def pair_counts() -> FloatArray:
    """(9, 9) comparisons of each pair, symmetric, that add up to the printed votes.

    The paper does not give them: these are the evenest, by proportional fitting.
    """
    fitted = np.outer(VOTES, VOTES)
    np.fill_diagonal(fitted, 0.0)
    for _ in range(500):
        scale = np.sqrt(VOTES / fitted.sum(axis=1))
        fitted *= scale[:, None] * scale[None, :]
    return fitted


def simulated_votes(seed: int) -> Comparisons:
    """5,760 simulated votes of the printed ratings; single votes are independent."""
    games, chances = _expected(TIE_SHARE)
    return _votes(np.random.default_rng(seed).multinomial(games, chances))


def fitting_votes(tie_share: float) -> Comparisons:
    """As many votes whose ratings are the printed ones, to two points; nothing is drawn."""
    games, chances = _expected(tie_share)
    counts = np.rint(games[:, None] * chances).astype(np.int64)
    counts[:, 2] = games - counts[:, 0] - counts[:, 1]
    return _votes(counts)


def _expected(tie_share: float) -> tuple[IntArray, FloatArray]:
    """(P,) votes on each pair, and (P, 3) how likely low wins, neither, high wins."""
    low, high = np.triu_indices(len(NAMES), 1)
    share = pair_counts()[low, high]
    expected = 1.0 / (1.0 + np.exp((ELO[high] - ELO[low]) / ELO_PER_LOGIT))
    tie = 2.0 * np.minimum(expected, 1.0 - expected)
    tie *= tie_share * share.sum() / (share * tie).sum()
    chances = np.stack([expected - tie / 2, tie, 1.0 - expected - tie / 2], axis=1)
    return np.rint(share).astype(np.int64), chances


def _votes(counts: IntArray) -> Comparisons:
    low, high = np.triu_indices(len(NAMES), 1)
    pair, outcome = np.nonzero(counts)
    nobody = np.zeros(len(pair), dtype=np.int64)
    return Comparisons(
        names=NAMES,
        first=low[pair],
        second=high[pair],
        score=np.array([WIN, TIE, LOSS])[outcome],
        expert=nobody,
        scenario=nobody.copy(),
        count=counts[pair, outcome],
    )
