"""Whether some contestants gain more than others by being on the left.

Sides are drawn by lot for each showing, so votes of different showings can't hang together by
their side: votes of one expert on one scenario are one cluster of Wald's test.

Notation: R rows, C contestants.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import fdtrc

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons, FloatArray, renumber_codes
from arena.rating.interactions import Interaction, cells_of
from arena.rating.logistic import fit_with_columns, parameter_covariance


def side_interaction(votes: Comparisons) -> Interaction | None:
    """Whether some contestants gain more than others by being on the left.

    Args:
        votes: `first` was shown on the left.

    Returns:
        None where the votes do not determine it: some contestant was hardly on one of the sides.
    """
    contestants = len(votes.names)
    if contestants < 3:
        return None  # with two the gain of one is the gain of the other
    columns = np.zeros((len(votes), contestants))
    rows = np.arange(len(votes))
    columns[rows, votes.first] = columns[rows, votes.second] = 1.0
    fitted = fit_with_columns(votes, columns)
    if fitted is None:
        return None
    contrast = 2.0 * (np.eye(contestants) - 1.0 / contestants)
    effects = contrast @ fitted.coefficients * ELO_PER_LOGIT
    shown = renumber_codes(votes.expert * (int(votes.scenario.max()) + 1) + votes.scenario)[1]
    by_cell = replace(votes, expert=shown, scenario=np.zeros_like(shown))
    unit = Unit.EXPERT if shown.max() > 0 else Unit.VOTE
    whole = parameter_covariance(by_cell, fitted, unit)[contestants:, contestants:]
    covariance = contrast @ whole @ contrast.T
    statistic = float(effects @ np.linalg.pinv(covariance, rcond=1e-10, hermitian=True) @ effects)
    freedom = contestants - 1
    errors = np.sqrt(covariance.diagonal())
    played: FloatArray = np.bincount(votes.first, votes.count, contestants).astype(np.float64)
    played += np.bincount(votes.second, votes.count, contestants)
    many = np.full(contestants, 1e7)
    return Interaction(
        statistic=statistic,
        freedom=freedom,
        p_value=_above(statistic, freedom, int(shown.max()) + 1),
        rounds=0,
        cells=cells_of(votes.names, ("left",) * contestants, played, effects, errors, many),
    )


def _above(statistic: float, freedom: int, clusters: int) -> float | None:
    """How likely Wald's statistic of so many clusters is as large by chance (Hotelling's T2)."""
    rest = clusters - freedom
    if rest < 1:
        return None
    return float(fdtrc(freedom, rest, statistic * rest / (freedom * (clusters - 1))))
