"""Whether contestants are stronger on some scenario types than on others.

Every contestant may be stronger or weaker on some types than on the whole (Rao's score test,
which needs no fit of a type by itself). Votes on one scenario hang together, so the distribution
comes from giving the scenarios' types out anew, each with all its votes: whatever scenarios
differ in besides their type stays as it is.

Notation: R rows, C contestants, T types, S scenarios, B rounds, G clusters.
"""

from __future__ import annotations

import numpy as np

from arena.rating import bradley_terry
from arena.rating.bradley_terry import ELO_PER_LOGIT, Meetings
from arena.rating.chains import are_all_together
from arena.rating.comparisons import (
    Comparisons,
    FloatArray,
    IntArray,
    count_pairs,
    renumber_codes,
    select_votes,
)
from arena.rating.interactions import Effect, Interaction, cells_of
from arena.rating.moderated import LEAST
from arena.rating.pulls import Pulls, bradley_terry_pulls

FEWEST_LAYOUTS = 20
"""With fewer ways to give out the types no p-value falls below 5 %."""
_NUMBERS_AT_ONCE = 4_000_000
_RIDGE = 1e-9


def type_interaction(
    votes: Comparisons,
    type_of: IntArray,
    types: tuple[str, ...],
    strengths: FloatArray,
    *,
    rounds: int,
    seed: int,
) -> Interaction | None:
    """Whether contestants are stronger on some types than on others.

    Args:
        votes: They must determine the strengths.
        type_of: (R,) the type of each row's scenario, a number.
        types: (T,) names by these numbers.
        strengths: (C,) by all votes.
        rounds: Permutations.
        seed: Of them.

    Returns:
        None with fewer than two types.
    """
    found, of_row = renumber_codes(type_of)
    if len(found) < 2:
        return None
    expected = 1.0 / (1.0 + np.exp(strengths[votes.second] - strengths[votes.first]))
    _, scenario = renumber_codes(votes.scenario)
    if scenario.max(initial=0) == 0:  # nobody knows what was shown: votes are given out anew
        scenario = np.arange(len(votes))
    # A scenario of several types, as in votes from elsewhere, counts as one of each.
    units, unit_of = renumber_codes(scenario * len(found) + of_row)
    slopes, information = _by_unit(votes, expected, unit_of, len(units))
    layout = units % len(found)
    statistic, freedom = _statistics(slopes, information, layout[None], len(found))
    drawn = _permuted(slopes, information, layout, len(found), rounds, seed)
    p_value = None
    if freedom > 0 and len(drawn):
        above = int((drawn >= statistic[0] * (1.0 - 1e-9)).sum())
        p_value = (1 + above) / (1 + len(drawn))
    return Interaction(
        statistic=float(statistic[0]),
        freedom=freedom,
        p_value=p_value,
        rounds=len(drawn),
        cells=_type_cells(votes, of_row, tuple(types[one] for one in found.tolist())),
    )


# --- The test by type --------------------------------------------------------------------------


def _by_unit(
    votes: Comparisons, expected: FloatArray, unit_of: IntArray, units: int
) -> tuple[FloatArray, FloatArray]:
    """(S, C) slopes and (S, C * C) information of the votes of each scenario."""
    contestants = len(votes.names)
    pull = votes.count * (votes.score - expected)
    weight = votes.count * expected * (1.0 - expected)
    room = units * contestants
    slopes = np.bincount(unit_of * contestants + votes.first, pull, room).astype(np.float64)
    slopes -= np.bincount(unit_of * contestants + votes.second, pull, units * contestants)
    size = contestants**2
    information = np.zeros(units * size)
    for one, other, sign in (
        (votes.first, votes.first, 1.0),
        (votes.second, votes.second, 1.0),
        (votes.first, votes.second, -1.0),
        (votes.second, votes.first, -1.0),
    ):
        place = unit_of * size + one * contestants + other
        information += sign * np.bincount(place, weight, units * size)
    return slopes.reshape(units, contestants), information.reshape(units, size)


def _statistics(
    slopes: FloatArray, information: FloatArray, layouts: IntArray, types: int
) -> tuple[FloatArray, int]:
    """(B,) of layouts (B, S), and the degrees of freedom of the first."""
    contestants = slopes.shape[1]
    chosen = (layouts[:, None, :] == np.arange(types)[:, None]).astype(np.float64)
    of_types = (chosen @ slopes).reshape(-1, contestants)
    squares = (chosen @ information).reshape(-1, contestants, contestants)
    size = np.maximum(squares.diagonal(axis1=1, axis2=2).mean(axis=1), 1e-300)
    ridge = _RIDGE * size[:, None, None] * np.eye(contestants)
    # Slopes add to zero within each group that met, so they never point along a flat direction.
    solved = np.linalg.solve(squares + ridge, of_types[:, :, None])[:, :, 0]
    statistic = (of_types * solved).sum(axis=1).reshape(len(layouts), types).sum(axis=1)
    ranks = np.linalg.matrix_rank(squares[:types], hermitian=True, rtol=1e-8)
    return statistic, int(ranks.sum()) - (contestants - 1)


def _permuted(
    slopes: FloatArray,
    information: FloatArray,
    layout: IntArray,
    types: int,
    rounds: int,
    seed: int,
) -> FloatArray:
    """(B,) statistics with types given out anew; none where there are hardly any ways to."""
    several = np.bincount(layout, minlength=types)
    ways = 1.0
    for number in several.tolist():
        for place in range(1, number):
            ways *= (place + 1 + (several.sum() - number) / number) / (place + 1)
    if several.max() < 2 or ways < FEWEST_LAYOUTS:
        return np.empty(0)
    rng = np.random.default_rng(seed)
    at_once = max(1, _NUMBERS_AT_ONCE // (types * max(information.shape[1], len(layout))))
    blocks = []
    for first in range(0, rounds, at_once):
        number = min(at_once, rounds - first)
        layouts = rng.permuted(np.tile(layout, (number, 1)), axis=1)
        blocks.append(_statistics(slopes, information, layouts, types)[0])
    return np.concatenate(blocks)


# --- Cells -------------------------------------------------------------------------------------


def _type_cells(
    votes: Comparisons, of_row: IntArray, types: tuple[str, ...]
) -> tuple[Effect, ...]:
    """A contestant's rating on a type less the mean over all types that determine everybody's."""
    contestants = len(votes.names)
    parts = [_one_type(select_votes(votes, of_row == number)) for number in range(len(types))]
    fine = [number for number, part in enumerate(parts) if part is not None]
    names: list[str] = []
    conditions: list[str] = []
    played: list[FloatArray] = []
    effects: list[FloatArray] = []
    errors: list[FloatArray] = []
    degrees: list[FloatArray] = []
    fitted = [part for part in parts if part is not None]
    mean = np.mean([part[0] for part in fitted], axis=0) if fitted else np.zeros(contestants)
    for number, name in enumerate(types):
        own = select_votes(votes, of_row == number)
        names += votes.names
        conditions += [name] * contestants
        of_each = np.bincount(own.first, own.count, contestants)
        of_each = of_each + np.bincount(own.second, own.count, contestants)
        played.append(of_each.astype(np.float64))
        part = parts[number]
        if part is None or len(fine) < 2:
            unknown = np.full(contestants, np.nan)
            effects.append(unknown)
            errors.append(unknown)
            degrees.append(np.ones(contestants))
            continue
        effects.append((part[0] - mean) * ELO_PER_LOGIT)
        place = fine.index(number)
        errors.append(_errors(votes, of_row, fine, fitted, place))
        clusters = [len(renumber_codes(codes)[0]) for codes in (own.expert, own.scenario)]
        fewest = min((one for one in clusters if one > 1), default=own.votes)
        degrees.append(np.full(contestants, float(max(fewest - 1, 1))))
    return cells_of(
        tuple(names),
        tuple(conditions),
        np.concatenate(played),
        np.concatenate(effects),
        np.concatenate(errors),
        np.concatenate(degrees),
    )


def _one_type(votes: Comparisons) -> tuple[FloatArray, Pulls] | None:
    """(C,) strengths by a type's votes alone, and their pulls; None if not everybody's."""
    counts = count_pairs(votes)
    if not len(votes) or not are_all_together(len(votes.names), counts):
        return None
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    strengths = bradley_terry.newton(met, counts.games[:, None], counts.scores[:, None])[:, 0]
    inverse = bradley_terry.inverse_curvature(met, counts.games, strengths)
    return strengths, bradley_terry_pulls(votes, strengths, inverse)


def _errors(
    votes: Comparisons,
    of_row: IntArray,
    fine: list[int],
    fitted: list[tuple[FloatArray, Pulls]],
    place: int,
) -> FloatArray:
    """(C,) standard errors of a type's strengths less the mean of all, in points, clustered.

    A scenario has one type, so only experts' votes hang together across types.
    """
    contestants = len(votes.names)
    experts, expert_of = renumber_codes(votes.expert)
    by_expert = np.zeros((len(experts), contestants))
    of_scenarios, of_cells = np.zeros(contestants), np.zeros(contestants)
    for index, (number, (_, pulls)) in enumerate(zip(fine, fitted, strict=True)):
        share = (1.0 if index == place else 0.0) - 1.0 / len(fine)
        rows = of_row == number
        sums = np.zeros((len(experts), contestants))
        pull = pulls.surprise * pulls.count
        np.add.at(sums, (expert_of[rows], pulls.first), pull)
        np.add.at(sums, (expert_of[rows], pulls.second), -pull)
        by_expert += share * sums @ pulls.inverse
        _, scenario_of = renumber_codes(votes.scenario[rows])
        cells, cell_of = renumber_codes(expert_of[rows] * (scenario_of.max() + 1) + scenario_of)
        scenarios = int(scenario_of.max()) + 1
        of_cell = share**2 * pulls.by_cluster(cell_of, len(cells)).diagonal()
        of_cells += of_cell
        if scenarios > 1:
            more = scenarios / (scenarios - 1)
            of_scenarios += (
                more * share**2 * pulls.by_cluster(scenario_of, scenarios).diagonal() - of_cell
            )
    variance = of_cells + of_scenarios
    if len(experts) > 1:
        more = len(experts) / (len(experts) - 1)
        variance += more * ELO_PER_LOGIT**2 * (by_expert**2).sum(axis=0) - of_cells
    return np.asarray(np.sqrt(np.maximum(variance, LEAST * of_cells)))
