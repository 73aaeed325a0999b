"""The same for agreement, the panel, sides, types and sessions; see test_every_number."""

import itertools
import math
from collections import Counter, defaultdict
from typing import Any

import krippendorff
import numpy as np
import pytest
from scipy.stats import t

from arena.rating.comparisons import Estimate
from tests.results.oracles import POINTS, codes, glm
from tests.results.raw import CHECKS, Shown

pytestmark = pytest.mark.django_db  # so that there is a database; the study is made once


def test_agreement_by_krippendorffs_package_and_by_loops(shown: Shown) -> None:
    units: dict[tuple[str, frozenset[str]], list[tuple[str, float]]] = defaultdict(list)
    for vote in shown.main:
        units[vote.item, vote.names].append((vote.judge, vote.score_of(min(vote.names))))
    shared = [values for values in units.values() if len(values) > 1]
    judges = sorted({vote.judge for vote in shown.main})
    table = np.full((len(judges), len(shared)), np.nan)
    for column, values in enumerate(shared):
        for judge, score in values:
            table[judges.index(judge), column] = 2 * score
    found = shown.results.trust.agreement
    assert (found.units, found.judgements) == (len(shared), sum(map(len, shared)))
    levels: list[tuple[Any, Estimate]]
    levels = [("nominal", found.alpha), ("interval", found.alpha_interval)]
    for level, estimate in levels:
        theirs = krippendorff.alpha(reliability_data=table, level_of_measurement=level)
        assert estimate.value == pytest.approx(theirs, abs=1e-9)
    equal = [
        np.mean([a == b for (_, a), (_, b) in itertools.combinations(values, 2)])
        for values in shared
    ]
    # Gwet: what chance gives comes from all units, also those that one expert judged alone.
    shares = [
        np.mean([[s == v for v in (0, 0.5, 1)] for _, s in vs], axis=0) for vs in units.values()
    ]
    by_chance = (np.mean(shares, axis=0) * (1 - np.mean(shares, axis=0))).sum() / 2
    assert found.ac1.value == pytest.approx((np.mean(equal) - by_chance) / (1 - by_chance))
    assert f"{found.alpha.value:.2f} (" in shown.said("raters")
    agreed = Counter[str]()
    seen = Counter[str]()
    for values in shared:
        for judge, score in values:
            others = [other == score for who, other in values if who != judge]
            agreed[judge] += float(np.mean(others))  # type: ignore[assignment]
            seen[judge] += 1
    for line in shown.results.trust.raters:
        assert line.shared == seen[line.name]
        if line.shared:
            assert line.agreement.value == pytest.approx(agreed[line.name] / seen[line.name])
    assert found.percent.value == pytest.approx(sum(agreed.values()) / sum(seen.values()))


@pytest.mark.slow
def test_the_panel_counts_what_each_expert_did(shown: Shown) -> None:
    first = {vote.matchup: vote for vote in shown.votes}
    for line in shown.results.trust.raters:
        own = [vote for vote in shown.main if vote.judge == line.name]
        decided = [vote.score == 1.0 for vote in own if vote.score != 0.5]
        assert line.votes == len(own)
        assert line.median_ms == pytest.approx(np.median([vote.ms for vote in own]))
        assert line.fast == pytest.approx(np.mean([vote.ms < 1000 for vote in own]))
        assert line.ties == pytest.approx(np.mean([vote.score == 0.5 for vote in own]))
        assert line.left.value == pytest.approx(np.mean(decided))
        again = [v for v in shown.votes if v.kind == "repeat" and v.judge == line.name]
        alike = [v.score_of(v.left) == first[v.repeat_of or 0].score_of(v.left) for v in again]
        assert line.repeats == (len(again), sum(alike))
        checks = [v for v in shown.votes if v.kind == "check" and v.judge == line.name]
        passed = [v.score_of("interplan") == 1.0 for v in checks]
        assert line.checks == (len(checks), sum(passed))
        judged, figures = (row for row in shown.rows("raters") if row[0].startswith(line.name))
        assert judged[-1] == str(len(own))
        assert f"{100 * line.ties:.0f} %" in figures
    assert sum(line.checks[0] for line in shown.results.trust.raters) == CHECKS


def test_what_the_side_is_worth(shown: Shown) -> None:
    votes = shown.main
    experts = codes([vote.judge for vote in votes])
    found = glm(
        votes,
        shown.slugs,
        np.ones((len(votes), 1)),
        cov_type="cluster",
        cov_kwds={"groups": experts, "use_correction": False},
    )
    side, groups = shown.results.trust.side, len(np.unique(experts))
    value, error = found.params[-1] * POINTS, found.bse[-1] * POINTS
    assert side.advantage.value == pytest.approx(value, abs=1e-4)
    assert side.standard_error == pytest.approx(error * math.sqrt(groups / (groups - 1)), rel=1e-5)
    scale, degrees = _bell_mccaffrey(found, np.eye(groups)[experts])
    half = t.ppf(0.975, degrees) * error * math.sqrt(scale)
    assert side.advantage.upper == pytest.approx(value + half, rel=1e-5)


def _bell_mccaffrey(found: Any, of_expert: np.ndarray) -> tuple[float, float]:
    """By whole matrices of experts: the factor of the variance, and degrees of freedom."""
    design, expected = found.model.exog, found.fittedvalues
    certain = expected * (1.0 - expected)
    back = design @ np.linalg.inv(design.T @ (design * certain[:, None]))[-1]
    pulls = (found.model.endog - expected) * back
    weights, squares = of_expert.T @ (certain * back), of_expert.T @ pulls**2
    left = np.diag(weights) - np.outer(weights, weights)
    by_votes = np.trace(left @ np.diag(squares / weights**2) @ left.T)
    effect = ((of_expert.T @ pulls) ** 2).sum() - by_votes
    variance = np.diag(max(effect / np.trace(left @ left.T), 0.0) + squares / weights**2)
    form = left @ variance @ left.T
    scale = weights @ variance @ weights / np.trace(form)
    return scale, np.trace(form) ** 2 / np.trace(form @ form)
