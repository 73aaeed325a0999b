"""Likelihood of placed objects among recorded ones: a number from 0 to 1.

For each class of object and each feature a histogram is learned from recorded scenes, with one
more in each bin than was seen. The score of a feature is the geometric mean, over what was
placed, of the share p of the bin that it lies in:

    score(feature) = exp( mean over objects of ln p(bin of the object) )
    score(collision) = share of the objects that collide with nobody

and the realism of a change is the mean of these five. Classes of which little was recorded are
not judged. The idea of likelihoods under histograms is that of Waymo's Sim Agents challenge
(Montali et al. 2023), which asks it of trajectories. Frame: that of the scene.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from augment.checks.bodies import USUAL_MPS, overlap
from augment.checks.ground import ChangedScene, Ground
from augment.geometry.frames import difference
from augment.metrics.displacement import CLASS_OF, ObjectClass
from augment.render.camera import camera_for
from augment.scene.entities import Modification, TrafficAgent

REALISM_VERSION = 1
"""Raised whenever the same change of the same scenes would get another number."""

LEAST_RECORDED = 10
"""A class is judged where the other scenes hold so many of it."""


class Feature(StrEnum):
    """Measured property of an object, as a column is called."""

    SPEED = "speed"
    HEADING = "heading"
    GAP = "gap"
    EDGE = "edge"


COLLISION = "collision"
SCORES = (*(feature.value for feature in Feature), COLLISION)

EDGES: dict[Feature, tuple[float, ...]] = {
    Feature.SPEED: (0.5, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0),
    Feature.HEADING: (5.0, 10.0, 20.0, 45.0, 90.0, 135.0, 160.0, 170.0, 175.0),
    Feature.GAP: (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0),
    Feature.EDGE: (-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0),
}
"""Where bins meet, which belongs to the upper one; the first and the last bin are open. Speed in
m/s; degrees between the heading and that of the lane under the centre, else of the nearest one,
0 to 180; metres from the box to the nearest other box; metres from the centre to the edge of the
road, negative off it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedObject:
    """Measured properties of one object.

    Attributes:
        bins: The number of its bin by feature; without what the map does not say.
        collides: Whether the checks find its overlap with somebody doubtful or wrong.
    """

    object_class: ObjectClass
    bins: Mapping[Feature, int]
    collides: bool


RecordedCounts = Counter[tuple[ObjectClass, Feature, int]]
"""How many objects were seen, by class, feature and bin; sums of counts are counts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Realism:
    """Realism of one change.

    Attributes:
        scores: 0 to 1 by the names in `SCORES`; without what nothing says anything about.
        judged: How many objects count: those of whose class enough was recorded.
    """

    scores: Mapping[str, float]
    judged: int

    @property
    def mean(self) -> float | None:
        """The realism: the mean of the scores; None where nothing could be judged."""
        return float(np.mean(list(self.scores.values()))) if self.judged else None


def measure_change(ground: Ground, change: Modification) -> list[PlacedObject]:
    """Measure what a change adds and moves.

    Raises:
        InvalidModification: It does not fit the scene.
    """
    situation = ChangedScene.of(ground, change)
    if not situation.changed:
        return []
    collided = {
        name for finding in overlap(situation) if finding.is_fault for name in finding.agents
    }
    gaps_m = situation.measure_gaps(situation.changed, situation.everyone).min(axis=1).tolist()
    return [
        PlacedObject(
            object_class=CLASS_OF[agent.type],
            bins={
                # 0 to the number of edges; "right": a value at an edge is in the upper bin.
                feature: int(np.searchsorted(EDGES[feature], value, side="right"))
                for feature, value in _measure(situation, agent, gap_m).items()
                if value is not None
            },
            collides=agent.id in collided,
        )
        for agent, gap_m in zip(situation.changed, gaps_m, strict=True)
    ]


def measure_recorded(ground: Ground) -> list[PlacedObject]:
    """Measure all of a scene as it was but its ego."""
    return measure_change(ground, Modification(moved=ground.scene.agents))


def count_recorded(objects: Iterable[PlacedObject]) -> RecordedCounts:
    """Return the histograms of what was recorded."""
    return Counter(
        (thing.object_class, feature, number)
        for thing in objects
        for feature, number in thing.bins.items()
    )


def judge(objects: Sequence[PlacedObject], recorded: RecordedCounts) -> Realism:
    """Return how realistic objects are.

    Args:
        objects: What was placed.
        recorded: Of other scenes than the one in which they are.
    """
    seen = Counter[ObjectClass]()
    for (object_class, feature, _), number in recorded.items():
        seen[object_class] += number * (feature is Feature.SPEED)  # which all objects have
    judgeable = [thing for thing in objects if seen[thing.object_class] >= LEAST_RECORDED]
    scores = {}
    for feature in Feature:
        # Logarithms: a product of many shares would underflow.
        logs = [
            math.log(_share(recorded, thing.object_class, feature, thing.bins[feature]))
            for thing in judgeable
            if feature in thing.bins
        ]
        if logs:
            scores[feature.value] = math.exp(float(np.mean(logs)))
    if judgeable:
        scores[COLLISION] = float(np.mean([not thing.collides for thing in judgeable]))
    return Realism(scores=scores, judged=len(judgeable))


def place_at_random(
    ground: Ground, change: Modification, rng: np.random.Generator
) -> Modification:
    """Return the same objects anywhere in the picture's window, in any heading at any usual speed.

    Args:
        ground: Of the scene before the change.
        change: Says which objects, and with the scene which window.
        rng: All draws come from it.
    """
    window = camera_for(ground.scene, change)

    def throw(agent: TrafficAgent) -> TrafficAgent:
        return replace(
            agent,
            x_m=float(rng.uniform(window.x_min_m, window.x_max_m)),
            y_m=float(rng.uniform(window.y_min_m, window.y_max_m)),
            heading_rad=float(rng.uniform(-math.pi, math.pi)),
            speed_mps=float(rng.uniform(0.0, USUAL_MPS.get(agent.type, 0.0))),
            walk_to_m=None,
        )

    return change.with_changed(map(throw, change.changed))


# --- Private -----------------------------------------------------------------------------------


def _measure(
    situation: ChangedScene, agent: TrafficAgent, gap_m: float
) -> dict[Feature, float | None]:
    lane = situation.under[agent.id] or situation.nearest[agent.id]
    # A map without lanes has no direction to turn from: the feature is left out.
    turn_deg = None
    if lane is not None:
        turn_deg = abs(math.degrees(difference(agent.heading_rad, lane.tangent_rad)))
    return {
        Feature.SPEED: abs(agent.speed_mps),
        Feature.HEADING: turn_deg,
        Feature.GAP: gap_m,
        Feature.EDGE: situation.ground.road.edge_m(agent.x_m, agent.y_m),
    }


def _share(
    recorded: RecordedCounts, object_class: ObjectClass, feature: Feature, number: int
) -> float:
    # One more in each bin than was seen: no bin is impossible, and shares still add up to 1.
    counts = [
        1 + recorded[object_class, feature, other] for other in range(len(EDGES[feature]) + 1)
    ]
    return counts[number] / sum(counts)
