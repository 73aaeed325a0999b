"""How many votes an interval needs.

Notation: C contestants, half-widths in Elo points.
"""

from __future__ import annotations

import math

from scipy.special import ndtri

from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.estimate import LEVEL
from arena.rating.leaderboard import Leaderboard

QUANTILE = float(ndtri(0.5 + LEVEL / 2))


def votes_for(
    *, contestants: int, half_width: float, tie_share: float, design_effect: float = 1.0
) -> int:
    """Votes per contestant until its 95 % interval is +-`half_width` points.

    For a balanced plan and contestants close to each other: with n votes each the variance of a
    strength is 4 (1 - t) (C - 1)^2 / (C^2 n), because a tie leaves less to chance. Every vote
    serves two contestants, so the whole study needs C / 2 times as many.

    Args:
        contestants: C, 2 or more.
        half_width: More than 0.
        tie_share: t, from 0 to below 1.
        design_effect: How much larger the variance is than that of independent votes.

    Raises:
        ValueError: An argument is out of range.
    """
    if contestants < 2 or half_width <= 0 or not 0 <= tie_share < 1 or design_effect <= 0:
        raise ValueError(
            "2 contestants or more, a half-width above 0, a tie share from 0 to below 1 and a "
            f"design effect above 0 are needed, not {contestants}, {half_width}, {tie_share} and "
            f"{design_effect}"
        )
    strength = half_width / (QUANTILE * ELO_PER_LOGIT)
    variance = 4.0 * (1.0 - tie_share) * ((contestants - 1) / contestants) ** 2
    return math.ceil(design_effect * variance / strength**2)


def votes_until(*, votes: int, half_width: float, wanted: float) -> int:
    """Votes in all until an interval of +-`half_width` by `votes` votes has become +-`wanted`.

    Widths fall with the square root of the number of votes as long as experts and scenarios grow
    along with it: more votes of the same experts on the same scenarios narrow it less.

    Raises:
        ValueError: A number is not positive.
    """
    if votes <= 0 or half_width <= 0 or wanted <= 0:
        raise ValueError(f"positive numbers are needed, not {votes}, {half_width} and {wanted}")
    return math.ceil(votes * (half_width / wanted) ** 2)


def design_effects(board: Leaderboard, independent: Leaderboard) -> list[float]:
    """How many votes weigh as much as one independent vote, by contestant with an interval.

    The ratio of the variances. Half-widths would also count what Student's t adds for few experts.

    Args:
        board: Its covariance knows of experts and scenarios.
        independent: The same votes rated as if each stood for itself.
    """
    if board.covariance is None or independent.covariance is None:
        return []
    both = zip(board.covariance.diagonal(), independent.covariance.diagonal(), strict=True)
    return [
        float(clustered / alone)
        for line, (clustered, alone) in zip(board.lines, both, strict=True)
        if line.lower is not None and line.upper is not None and alone > 0.0
    ]
