"""What somebody who drives expects of a scenario, apart from what its sentence asks for.

One function a rule; each yields its reasons why a scenario is not as it should be.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from augment.checks import Ground
from augment.checks.ground import gaps_m
from augment.checks.lanes_across import LanesAcross, find_mark
from augment.checks.situation import VEHICLES, is_stopped
from augment.geometry.frames import Box, Pose, overlap
from augment.render.camera import Camera, camera_for
from augment.scene.codec import ENGLISH, CatalogueEntry
from augment.scene.entities import AgentType, ScenarioType, Scene, TrafficAgent
from augment.scene.intent import LaneChoice, MapPlace, Setting

TOUCH_M = 0.1
"""The widest gap between cars that have crashed."""
NEAR_JUNCTION_M = 10.0
"""Somebody who names a place so near before a junction names the junction."""
HIDDEN_SHARE, TRAFFIC_SHARE, ONCOMING_SHARE = 0.5, 0.7, 0.7
"""Of a set's jaywalkers, scenarios and overtakes."""
FEWEST_OTHERS = 3
_AT_EDGE_M = 0.6
_JUNCTION = re.compile(r"intersection|junction|crossing|crossroads|side street", re.IGNORECASE)
_HIDING = {Setting.BY_PARKED_LEFT, Setting.BY_PARKED_RIGHT}


@dataclass(frozen=True, kw_only=True, eq=False)
class StagedScenario:
    """An entry and the scene that it is shown in, its traffic kept or cleared."""

    entry: CatalogueEntry
    scene: Scene

    @cached_property
    def lanes(self) -> LanesAcross | None:
        """The ego's route, None where the map has no lane for it."""
        return LanesAcross.of(Ground.of(self.scene))

    @cached_property
    def camera(self) -> Camera:
        """Of the scenario's pictures."""
        return camera_for(self.scene, self.entry.reference)

    def added(self, *types: AgentType) -> list[TrafficAgent]:
        """What the reference adds of these types."""
        return [one for one in self.entry.reference.added if one.type in types]

    def ahead_m(self, agent: TrafficAgent) -> float:
        """How far along the ego's route."""
        assert self.lanes is not None
        return self.lanes.route.locate_agent(agent).ahead_m

    def left_m(self, agent: TrafficAgent) -> float:
        """How far left of the ego's route."""
        assert self.lanes is not None
        return self.lanes.route.locate_agent(agent).left_m

    def is_in_lane(self, agent: TrafficAgent, choice: LaneChoice) -> bool:
        """Whether an agent's centre is in that lane."""
        band = None if self.lanes is None else self.lanes.band(choice, self.ahead_m(agent))
        return band is not None and abs(self.left_m(agent) - band.left_m) < band.width_m / 2.0

    def shows(self, agent: TrafficAgent) -> bool:
        """Whether the picture holds an agent's centre."""
        x_px, y_px = self.camera.to_pixels(np.array([[agent.x_m, agent.y_m]]))[0]
        is_across = 0.0 <= float(x_px) <= self.camera.width_px
        return is_across and 0.0 <= float(y_px) <= self.camera.height_px


# Of one scenario


def find_apart(one: StagedScenario) -> Iterator[str]:
    """Crashed vehicles of which one touches none before it."""
    cars = one.added(*VEHICLES) if one.entry.type is ScenarioType.ACCIDENT_SITE else []
    if not cars:
        return
    gaps = gaps_m(np.array([car.box.corners_m for car in cars]))
    for number, car in enumerate(cars[1:], start=1):
        gap_m = gaps[number, :number].min()
        if gap_m > TOUCH_M:
            yield f"{car.id} has crashed into nobody: {gap_m:.2f} m off"


def find_unguarded(one: StagedScenario) -> Iterator[str]:
    """Roadworks without sign, barrier or worker, or in an order that guards nobody."""
    if one.entry.type is not ScenarioType.CONSTRUCTION_ZONE or one.lanes is None:
        return
    parts = {
        "sign": one.added(AgentType.CONSTRUCTION_SIGN),
        "barrier": one.added(AgentType.BARRIER),
        "worker": one.added(AgentType.PEDESTRIAN),
        "cone": one.added(AgentType.TRAFFIC_CONE),
    }
    missing = [name for name, found in parts.items() if not found]
    if missing:
        yield f"its roadworks have no {', no '.join(missing)}"
        return
    cones = sorted(parts["cone"], key=one.ahead_m)
    if one.ahead_m(parts["sign"][0]) >= one.ahead_m(cones[0]):
        yield "its sign stands behind its first cone"
    if one.ahead_m(parts["worker"][0]) <= min(map(one.ahead_m, parts["barrier"])):
        yield "its worker stands before the barrier"
    yield from _shapeless(one, cones)


def _shapeless(one: StagedScenario, cones: list[TrafficAgent]) -> Iterator[str]:
    assert one.lanes is not None
    lefts = [one.left_m(cone) for cone in cones]
    band = one.lanes.band(LaneChoice.OWN, one.ahead_m(cones[0]))
    if band is not None and abs(abs(lefts[0]) - band.width_m / 2.0) > _AT_EDGE_M:
        yield f"its first cone stands {abs(lefts[0]):.1f} m off the lane centre, not at an edge"
    steps = np.diff(lefts)
    if (steps > _WAVER_M).any() and (steps < -_WAVER_M).any():
        yield "its cones lead to both sides"


_WAVER_M = 0.05


def find_unnamed_junction(one: StagedScenario) -> Iterator[str]:
    """What stands in, past or right before a junction that the wish does not name."""
    intent = one.entry.intent
    if one.lanes is None or intent is None or not one.entry.reference.added:
        return
    wanted = _settings_at(one, one.entry.reference.added[0])
    spots = [request.spot for request in intent.requests]
    given = {setting for spot in spots for setting in spot.settings}
    if not wanted or any(spot.mark is not None for spot in spots):
        return
    if not wanted & given:
        yield f"its intent does not say that it is {min(wanted)}"
    if one.entry.language == ENGLISH and not _JUNCTION.search(one.entry.instruction):
        yield "its sentence names no junction"


def _settings_at(one: StagedScenario, agent: TrafficAgent) -> set[Setting]:
    """Which named places fit where an agent stands; none where no junction is near."""
    assert one.lanes is not None
    start_m = find_mark(one.lanes, MapPlace.JUNCTION_START)
    end_m = find_mark(one.lanes, MapPlace.JUNCTION_END)
    if start_m is None or end_m is None:
        return set()
    ahead_m, half_m = one.ahead_m(agent), agent.length_m / 2.0
    if ahead_m - half_m >= end_m:
        return {Setting.AFTER_INTERSECTION, Setting.AT_INTERSECTION}
    if ahead_m + half_m > start_m:
        return {Setting.IN_INTERSECTION, Setting.AT_INTERSECTION}
    if ahead_m + half_m > start_m - NEAR_JUNCTION_M:
        return {Setting.BEFORE_INTERSECTION, Setting.AT_INTERSECTION}
    return set()


def find_unhidden(one: StagedScenario) -> Iterator[str]:
    """Walkers who step out from behind something in the sentence, and are in full view."""
    intent = one.entry.intent
    if intent is None or one.entry.type is not ScenarioType.JAYWALKER:
        return
    hides = {setting for request in intent.requests for setting in request.spot.settings}
    if (hides & _HIDING or one.added(*VEHICLES)) and not is_hidden(one):
        yield "its jaywalker is to come from behind something and is in full view"


RULES = (find_apart, find_unguarded, find_unnamed_junction, find_unhidden)


# Of a whole set


def is_hidden(one: StagedScenario) -> bool:
    """Whether a vehicle stands between the ego and where the first walk begins."""
    walkers = [walker for walker in one.entry.reference.added if walker.walk_to_m is not None]
    if not walkers:
        return False
    ego, walker = one.scene.ego, walkers[0]
    dx_m, dy_m = walker.x_m - ego.x_m, walker.y_m - ego.y_m
    sight = Box(
        pose=Pose(
            x_m=ego.x_m + dx_m / 2.0, y_m=ego.y_m + dy_m / 2.0, heading_rad=math.atan2(dy_m, dx_m)
        ),
        length_m=math.hypot(dx_m, dy_m),
        width_m=_SIGHT_M,
    )
    return any(
        overlap(sight, car.box).area_m2 > 0.0
        for car in (*one.scene.agents, *one.entry.reference.added)
        if car.type in VEHICLES and is_stopped(car)
    )


_SIGHT_M = 0.02


def has_traffic(one: StagedScenario) -> bool:
    """Whether the picture shows a few others, and one of them drives."""
    seen = [other for other in one.scene.agents if one.shows(other)]
    return len(seen) >= FEWEST_OTHERS and any(_drives(other) for other in seen)


def has_oncoming(one: StagedScenario) -> bool:
    """Whether the picture shows somebody who drives towards the ego in the oncoming lane."""
    return any(
        _drives(other) and one.shows(other) and one.is_in_lane(other, LaneChoice.ONCOMING)
        for other in one.scene.agents
    )


def _drives(agent: TrafficAgent) -> bool:
    return agent.type in VEHICLES and not is_stopped(agent)


def find_sparse(staged: list[StagedScenario]) -> Iterator[str]:
    """Shares of a set that are too low for what people drive through."""
    jaywalkers = [one for one in staged if one.entry.type is ScenarioType.JAYWALKER]
    overtakes = [one for one in staged if one.entry.type is ScenarioType.OVERTAKE]
    for among, holds, least, what in (
        (staged, has_traffic, TRAFFIC_SHARE, "scenarios show traffic"),
        (overtakes, has_oncoming, ONCOMING_SHARE, "overtakes have oncoming traffic"),
        (jaywalkers, is_hidden, HIDDEN_SHARE, "jaywalkers are hidden at first"),
    ):
        count = sum(holds(one) for one in among)
        if count < least * len(among):
            yield f"{count} of {len(among)} {what}; at least {least:.0%} should"
