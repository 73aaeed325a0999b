"""The moving set, driven: `python -m bench.moving_set` writes a table into docs/catalogue.md.

PDM-Closed drives every scenario's scene with the reference in it, in closed loop. Time to
collision and required braking are those towards what the reference changes.
"""

import argparse
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from augment.scene.planned_motion import EGO_ID, MotionPreset
from augment.scene.planned_mover import PlannedMover
from augment.simulation.drive import Drive, find_expert, run
from augment.simulation.planners import PDM_CLOSED, planner_named
from augment.simulation.road import Road
from augment.simulation.score import collisions, criticality, score_drive
from augment.simulation.states import STEP_S, Objects
from augment.simulation.traffic import DriveSetting
from bench.report import ROOT, table, write_block
from tests.fixtures.shelf import MOVING_SLUGS, entry, shown_scene

PROCESSES = 2
TTC_S, BRAKING_MPS2 = (0.5, 3.0), (3.0, 8.0)
"""What is neither trivial nor unavoidable: the time from the first to below the second."""


@dataclass(frozen=True, kw_only=True)
class Met:
    """How PDM-Closed met one scenario.

    Attributes:
        fired_s: When the reference's motion set out; None for never.
        least_ttc_s: None above 3 s.
        braking_mps2: The highest required braking.
        least_m: The least clearance; None where nobody changed was there.
        fault: Whether the ego hit somebody at fault.
        score: Of the drive, 0 to 1.
    """

    slug: str
    fired_s: float | None
    least_ttc_s: float | None
    braking_mps2: float
    least_m: float | None
    fault: bool
    score: float

    @property
    def is_critical(self) -> bool:
        """Whether it is neither trivial nor unavoidable."""
        in_time = self.least_ttc_s is not None and TTC_S[0] <= self.least_ttc_s < TTC_S[1]
        return in_time or BRAKING_MPS2[0] <= self.braking_mps2 <= BRAKING_MPS2[1]


def meet(slug: str) -> Met:
    """Drive one scenario."""
    scene, reference = shown_scene(slug), entry(slug).reference
    setting = DriveSetting(scene=scene, modification=reference)
    road = Road(scene)
    drive = run(setting, planner_named(PDM_CLOSED), road=road)
    names = {agent.id for agent in reference.changed}
    changed = replace(drive, objects=[_named(objects, names) for objects in drive.objects])
    met = collisions(changed)
    critical = criticality(changed, met)
    return Met(
        slug=slug,
        fired_s=_fired_s(setting, road, drive),
        least_ttc_s=critical["least_ttc_s"],
        braking_mps2=critical["required_braking_mps2"] or 0.0,
        least_m=critical["least_distance_m"],
        fault=any(one.at_fault for one in met),
        score=score_drive(drive, find_expert(setting, road)).value,
    )


def list_all(met: list[Met]) -> str:
    """A row a scenario, in Markdown."""
    rows = [
        [
            one.slug,
            _number(one.fired_s),
            _number(one.least_ttc_s),
            _number(one.braking_mps2),
            _number(one.least_m),
            "yes" if one.fault else "",
            f"{one.score:.2f}",
            "yes" if one.is_critical else "",
        ]
        for one in met
    ]
    head = ["scenario", "starts (s)", "TTC (s)", "braking (m/s²)", "clearance (m)", "hit"]
    return table([*head, "score", "critical"], rows)


def count_kinds(met: list[Met]) -> str:
    """The counts, and a row a kind."""
    counts = (
        f"Of {len(met)} motions {sum(one.fired_s is not None for one in met)} start; "
        f"{sum(one.is_critical for one in met)} scenarios are neither trivial nor unavoidable; "
        f"{sum(one.fault for one in met)} end in a collision at fault."
    )
    rows = []
    for kind in MotionPreset:
        own = [one for one in met if entry(one.slug).type is kind]
        times_s = [one.least_ttc_s for one in own if one.least_ttc_s is not None]
        needed = [one.braking_mps2 for one in own]
        critical = f"{sum(one.is_critical for one in own)} of {len(own)}"
        mean = f"{np.mean([one.score for one in own]):.2f}"
        rows.append([kind.label, _span(times_s), _span(needed), critical, mean])
    head = ["kind", "least TTC (s)", "required braking (m/s²)", "critical", "mean score"]
    return f"{counts}\n\n{table(head, rows)}"


def main() -> None:
    """Drive those that are named, or all, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("slugs", nargs="*", help="only these, printed and not written")
    slugs = parser.parse_args().slugs
    with get_context("spawn").Pool(PROCESSES) as pool:
        met = pool.map(meet, slugs or MOVING_SLUGS, chunksize=1)
    print(list_all(met))
    if not slugs:
        write_block("moving set", count_kinds(met), page=ROOT / "docs" / "catalogue.md")


# Private


def _named(objects: Objects, names: set[str]) -> Objects:
    return objects.chosen(np.array([name in names for name in objects.ids], dtype=np.bool_))


def _fired_s(setting: DriveSetting, road: Road, drive: Drive) -> float | None:
    """When the motion set out in a drive, which is gone through again."""
    (agent,) = [agent for agent in setting.after.agents if agent.motion is not None]
    mover = PlannedMover(agent, road.graph)
    for step, (box, objects) in enumerate(zip(drive.boxes, drive.objects, strict=True)):
        everybody = zip([EGO_ID, *objects.ids], [box, *objects.boxes], strict=True)
        mover.advance(step * STEP_S)
        mover.react({name: (float(one[0]), float(one[1])) for name, one in everybody})
    return mover.started_s


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def _span(values: list[float]) -> str:
    return f"{min(values):.1f} to {max(values):.1f}" if values else "–"


if __name__ == "__main__":
    main()
