"""What the numbers of the results are held against: others' packages and plain loops."""

import math
from typing import Any

import numpy as np
import statsmodels.api as sm
from scipy.stats import t

from tests.results.raw import RawVote, strengths_of

POINTS = 400.0 / math.log(10.0)


def glm(
    votes: list[RawVote], slugs: list[str], extra: np.ndarray | None = None, **how: Any
) -> Any:
    design = strengths_of(votes, slugs)
    if extra is not None:
        design = np.hstack([design, extra])
    score = np.array([vote.score for vote in votes])
    return sm.GLM(score, design, family=sm.families.Binomial()).fit(tol=1e-12, **how)


def elo_of(fitted: Any, slugs: list[str]) -> dict[str, float]:
    strengths = np.append(0.0, fitted.params[: len(slugs) - 1])
    return dict(zip(slugs, 1000.0 + POINTS * (strengths - strengths.mean()), strict=True))


def codes(values: list[str]) -> np.ndarray:
    order = sorted(set(values))
    return np.array([order.index(value) for value in values])


def influences(votes: list[RawVote], slugs: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """(V, C) how far each vote pulls each rating, in points; (V, C) its information there."""
    fitted = glm(votes, slugs)
    design = strengths_of(votes, slugs)
    expected = fitted.fittedvalues
    bread = np.linalg.inv(design.T @ (design * (expected * (1 - expected))[:, None]))
    back = np.vstack([np.zeros(len(slugs) - 1), bread])
    back -= back.mean(axis=0)
    surprise = np.array([vote.score for vote in votes]) - expected
    pulls = POINTS * (design * surprise[:, None]) @ back.T
    takes_part = np.array([[slug in vote.names for slug in slugs] for vote in votes])
    return pulls, takes_part * (expected * (1 - expected))[:, None]


def squares(pulls: np.ndarray, cluster: np.ndarray) -> np.ndarray:
    """(C, C) of the sums by cluster."""
    sums = np.array([pulls[cluster == one].sum(axis=0) for one in np.unique(cluster)])
    return np.asarray(sums.T @ sums)


def moderated(votes: list[RawVote], slugs: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """(C,) half-widths and (C,) variances of the default intervals, by docs/rating.md."""
    pulls, information = influences(votes, slugs)
    experts, items = codes([v.judge for v in votes]), codes([v.item for v in votes])
    inner = squares(pulls, experts * 1000 + items)
    base, single = inner.diagonal(), (pulls**2).sum(axis=0)
    total, parts = -base, []
    number = len(slugs)
    for cluster in (experts, items):
        groups = np.unique(cluster)
        raw = squares(pulls, cluster).diagonal()
        shares = np.array([information[cluster == one].sum(axis=0) for one in groups])
        shares /= shares.sum(axis=0)
        uneven = (shares**2).sum(axis=0)
        even_left = 1.0 - uneven
        left = np.maximum(1.0 - 2.0 * (shares**3).sum(axis=0) / uneven + uneven, 0.5 * even_left)
        centred = np.eye(number) - 1.0 / number
        room = centred @ np.diag(uneven) @ centred
        weight = 1.0 / single**2
        effect = (weight * (raw - base * even_left)).sum()
        effect /= (weight * room.diagonal() * left).sum()
        values, ways = np.linalg.eigh(inner + effect * room)
        common = ((ways * np.maximum(values, 0.0)) @ ways.T).diagonal()
        common = common if effect >= 0 else np.maximum(common, 0.6 * base)
        noise = np.minimum(base / common, 1.0)
        left = noise * even_left + (1.0 - noise) * left
        degrees, own = left / uneven, raw / left
        ratio = own / common
        surplus = (degrees * ((ratio - 1) ** 2 - 2 / degrees)).sum() / degrees.sum()
        surplus /= 1 + 2 / degrees.mean()
        prior = 24.0 if surplus <= 0 else min(24.0, 4 + 2 / surplus)
        variance = (prior * common + degrees * own) / (prior + degrees)
        total = total + variance
        parts.append((variance, np.minimum(prior + degrees, degrees.sum() * (1 - 1 / number))))
    total = np.maximum(total, 0.6 * base)
    freedom = total**2 / sum(variance**2 / degrees for variance, degrees in parts)
    return t.ppf(0.975, freedom) * np.sqrt(total), total
