"""What PDM-Closed makes of the catalogue: `python -m bench.catalogue_driving`.

Drives every scene for 15 s, before its change and with its reference, with either set of offsets,
and prints what docs/simulation.md says: mean scores by type, where the emergency brake was seen,
and how slow the ego got before jaywalkers. 200 drives of 2 s of one core each.
"""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from augment.scene.entities import Modification, ScenarioType
from augment.simulation.drive import Drive, expert_of, run
from augment.simulation.pdm_closed import PdmClosed
from augment.simulation.planners import OFFSETS_M
from augment.simulation.road import Road
from augment.simulation.score import ScoreKind, score_drive
from augment.simulation.states import SPEED
from augment.simulation.traffic import DriveSetting
from bench.report import table
from tests.fixtures.shelf import SLUGS, entry, shown_scene

SCENES = ("unmodified", "reference")


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven:
    """One drive, scored."""

    slug: str
    kind: ScenarioType
    scene: str
    offsets: str
    scores: dict[ScoreKind, float]
    slowest_mps: float
    brakes: int


def drives(slugs: list[str]) -> Iterator[Driven]:
    """Every drive of these scenarios, as it is done."""
    for slug in slugs:
        one, scene = entry(slug), shown_scene(slug)
        road = Road(scene)
        plain = DriveSetting(scene=scene, replay=one.keep_traffic)
        expert = expert_of(plain, road)
        for name, change in zip(SCENES, (Modification(), one.reference), strict=True):
            setting = DriveSetting(
                scene=scene, modification=change or Modification(), replay=one.keep_traffic
            )
            for offsets, offsets_m in OFFSETS_M.items():
                drive = run(setting, PdmClosed(offsets_m), road=road)
                scores = {
                    kind: score_drive(
                        drive,
                        expert,
                        kind=kind,
                        scenario_type=one.type,
                        modification=setting.modification,
                    ).value
                    for kind in ScoreKind
                }
                yield _driven(slug, one.type, name, offsets, scores, drive)


def main() -> None:
    """Drive and print; with slugs as arguments these alone."""
    found = []
    for one in drives(sys.argv[1:] or SLUGS):
        found.append(one)
        said = ", ".join(f"{kind.value} {100 * value:.1f}" for kind, value in one.scores.items())
        print(f"{one.slug}, {one.scene}, {one.offsets}: {said}", file=sys.stderr, flush=True)
    kinds = [kind for kind in ScenarioType if any(one.kind is kind for one in found)]
    rows: defaultdict[tuple[str, str, str], list[Driven]] = defaultdict(list)
    for one in found:
        for score in ScoreKind:
            rows[one.scene, one.offsets, score.value].append(one)
    lines = []
    for (scene, offsets, whose), drawn in rows.items():
        means = [
            _mean([one.scores[ScoreKind(whose)] for one in drawn if kind in (None, one.kind)])
            for kind in (None, *kinds)
        ]
        lines.append([f"{scene}, {offsets}, {whose}", *means])
    print(table(["scenes, offsets, score", "all", *(kind.value for kind in kinds)], lines))
    braked = [one for one in found if one.brakes]
    print()
    print(
        table(
            ["emergency brake in", "offsets", "steps"],
            [[one.slug, one.offsets, str(one.brakes)] for one in braked],
        )
    )
    slow = [
        [one.slug, one.offsets, f"{one.slowest_mps:.1f}"]
        for one in found
        if one.kind is ScenarioType.JAYWALKER and one.scene == SCENES[1]
    ]
    print()
    print(table(["jaywalkers", "offsets", "slowest (m/s)"], slow))


def _driven(
    slug: str,
    kind: ScenarioType,
    scene: str,
    offsets: str,
    scores: dict[ScoreKind, float],
    drive: Drive,
) -> Driven:
    return Driven(
        slug=slug,
        kind=kind,
        scene=scene,
        offsets=offsets,
        scores=scores,
        slowest_mps=float(drive.states[:, SPEED].min()),
        brakes=sum(plan.braking for plan in drive.plans),
    )


def _mean(values: list[float]) -> str:
    return f"{100.0 * float(np.mean(values)):.1f}" if values else str(math.nan)


if __name__ == "__main__":
    main()
