"""Which drives the experts of a study may play: all of a scenario's pictures, or none of them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from arena.errors import NothingToPlan
from arena.pairing.rules import scenario_of
from arena.services.frames import MOST_NAMED, Cells
from augment.models import Simulation
from augment.services.judging.simulations import Options

Way = tuple[str, str, bool]
"""Planner, offsets, whether recorded traffic reacts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Replays:
    """How the drives were driven that a study plays, and of which scenarios, by slug."""

    planner: str
    offsets: str
    is_reactive: bool
    scenarios: list[str]


def replays_of(cells: Cells) -> Replays:
    """The scenarios of which every picture that takes part was driven in one and the same way.

    A pair with a drive on one side alone would tell who was driven, and so who made it; so would
    a missing one where only attention checks lack it. Of several ways the one with most scenarios
    is taken, then the usual one.

    Raises:
        NothingToPlan: There is no such scenario; the text names what was not driven.
    """
    wanted: defaultdict[str, set[int]] = defaultdict(set)
    for (scenario, _), cell in cells.items():
        wanted[scenario_of(scenario)].add(cell.pk)
    driven = _driven({cell.pk for cell in cells.values()})
    usual: Way = (Options().planner, Options().offsets, Options().is_reactive)
    whole = {
        way: sorted(slug for slug, pictures in wanted.items() if pictures <= found)
        for way, found in driven.items()
    }
    best = max(whole, key=lambda way: (len(whole[way]), way == usual, way), default=usual)
    if not whole.get(best):
        raise _nothing_driven(cells, driven.get(best, set()))
    planner, offsets, is_reactive = best
    return Replays(
        planner=planner, offsets=offsets, is_reactive=is_reactive, scenarios=whole[best]
    )


# Private


def _driven(pictures: set[int]) -> dict[Way, set[int]]:
    """Keys of the augmentations that were driven, by how."""
    found: defaultdict[Way, set[int]] = defaultdict(set)
    rows = Simulation.objects.filter(augmentation__in=pictures, state=Simulation.State.DONE)
    for row in rows.only("augmentation", "planner", "offsets", "is_reactive"):
        found[row.planner, row.offsets, row.is_reactive].add(row.augmentation_id or 0)
    return dict(found)


def _nothing_driven(cells: Cells, driven: set[int]) -> NothingToPlan:
    missing = sorted(names for names, cell in cells.items() if cell.pk not in driven)
    named = ", ".join(f"{who} on {where}" for where, who in missing[:MOST_NAMED])
    return NothingToPlan(
        "No scenario can be played: each needs a drive of every picture that takes part. "
        f"Not driven: {named}; {len(missing)} in all. Simulate their jobs first, or open the "
        "study without drives."
    )
