"""Whether the catalogue's references are what their intents ask for, and can be shown.

Those of the paper set are also held against what a driver expects (`catalogue_rules`).

Reads files, touches no rows.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from augment.checks import Ground
from augment.checks.ground import gaps_m
from augment.checks.lanes_across import LanesAcross, find_mark
from augment.checks.parties import AUTHORED
from augment.checks.registry import check_against_intent
from augment.checks.situation import VEHICLES, is_stopped
from augment.geometry.frames import Box, Pose, difference, overlap
from augment.geometry.polyline import FloatArray
from augment.prompts.vectors import DEFAULT_RADIUS_M
from augment.render.camera import Camera, camera_for
from augment.scene.codec import ENGLISH, CatalogueEntry, intent_to_parts
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    EGO_LENGTH_M,
    EGO_WIDTH_M,
    AgentType,
    CatalogueSet,
    Modification,
    ScenarioType,
    Scene,
    TrafficAgent,
    apply,
    without_traffic,
)
from augment.scene.intent import LaneChoice, MapPlace, Setting
from augment.scene.intent_statements import list_statements
from augment.services.scenarios.catalogue import folder_of, read_catalogue

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


CLEARANCE_M = 0.3
"""On either side of the ego, as it passes."""
EDGE_M = 0.25
"""So far over the edge of its lane the ego is still in it."""
_FURTHEST_M = 9.0
_STEP_M = 0.1
_ALONG_M = 2.0


class WayPast(StrEnum):
    """By which lane the ego gets past."""

    OWN = "own lane"
    BESIDE = "lane beside it"
    ONCOMING = "oncoming lane"
    NONE = "none"


def way_past(scene: Scene, change: Modification) -> WayPast:
    """The first of own lane, lane beside it and oncoming lane that is wide enough.

    What moves or walks is waited for. The ego passes all that was changed at one offset from its
    route, from an ego's length before the first to one past the last, and off parking bays.
    """
    after = apply(scene, change)
    ground = Ground.of(after)
    changed = {one.id for one in change.changed}
    standing = [one for one in after.agents if is_stopped(one) and one.walk_to_m is None]
    route = ground.route
    if route is None or not changed & {one.id for one in standing}:
        return WayPast.OWN
    blocks = {one.id: _extent(route, one) for one in standing}
    own = [block for name, block in blocks.items() if name in changed]
    start_m = min(low[0] for low, _ in own) - EGO_LENGTH_M
    end_m = max(high[0] for _, high in own) + EGO_LENGTH_M
    beside = [block for block in blocks.values() if block[0][0] < end_m and block[1][0] > start_m]
    half_m = EGO_WIDTH_M / 2.0 + CLEARANCE_M
    free = [
        offset_m
        for offset_m in _OFFSETS_M
        if all(offset_m + half_m <= low[1] or offset_m - half_m >= high[1] for low, high in beside)
    ]
    stations_m = np.arange(start_m, end_m, _ALONG_M).tolist()
    ways = [_worst(ground, route, offset_m, stations_m) for offset_m in free]
    return min(ways, key=_RANK, default=WayPast.NONE)


# Private


_OFFSETS_M: list[float] = np.arange(-_FURTHEST_M, _FURTHEST_M + _STEP_M, _STEP_M).tolist()
_RANK = list(WayPast).index


def _extent(route: EgoRoute, agent: TrafficAgent) -> tuple[FloatArray, FloatArray]:
    """The least and the most (s, d) of an agent's box."""
    places = [route.locate(float(x), float(y)) for x, y in agent.box.corners_m]
    spots = np.array([(place.ahead_m, place.left_m) for place in places])
    return spots.min(axis=0), spots.max(axis=0)


def _worst(
    ground: Ground, route: EgoRoute, offset_m: float, stations_m: Sequence[float]
) -> WayPast:
    """The worst that lies under the ego's sides and middle at that offset."""
    half_m = EGO_WIDTH_M / 2.0 - EDGE_M
    found = WayPast.OWN
    for s_m in stations_m:
        for left_m in (offset_m - half_m, offset_m, offset_m + half_m):
            found = max(found, _under(ground, route, s_m, left_m), key=_RANK)
            if found is WayPast.NONE:
                return found
    return found


def _under(ground: Ground, route: EgoRoute, ahead_m: float, left_m: float) -> WayPast:
    x_m, y_m = route.position(ahead_m, left_m)
    if ground.road.distance_m(x_m, y_m) > 0.0 or ground.carparks.distance_m(x_m, y_m) == 0.0:
        return WayPast.NONE
    lanes = [one for one in ground.lanes.beside(x_m, y_m) if one.covers]
    if not lanes or any(one.lane_id in route.lane_ids for one in lanes):
        return WayPast.OWN
    tangent_rad = route.heading_at(ahead_m)
    turns = [abs(difference(one.tangent_rad, tangent_rad)) for one in lanes]
    return WayPast.BESIDE if min(turns) < math.pi / 4.0 else WayPast.ONCOMING


MOST_ON_ONE_SCENE = 8

FEWEST_PARAPHRASES = 3
"""Of a scenario that has any."""

_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioCheck:
    """What was found about one scenario.

    Attributes:
        statements: How many its intent makes; each is held against the reference.
        way_past: By which lane the ego gets past what the reference adds.
        reasons: Why it is not as it should be; empty if all is well.
    """

    slug: str
    statements: int
    way_past: WayPast
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueCheck:
    """All scenarios of a folder, and what is wrong with the folder as a whole."""

    scenarios: tuple[ScenarioCheck, ...]
    reasons: tuple[str, ...]


def check_catalogue(
    *, folder: Path, sets: Sequence[CatalogueSet] = (CatalogueSet.PAPER,)
) -> CatalogueCheck:
    """Hold every reference against the geometric checks, its intent and its picture.

    Args:
        folder: Holds `scenes` and `scenarios`, and those of the hard set in `hard`.
        sets: Which parts of it.

    Raises:
        InvalidDocument: The folder holds no catalogue, or its files do not fit together.
    """
    read = {one: read_catalogue(folder_of(folder, one)) for one in sets}
    staged = {
        one: [_staged(scenes[entry.scene], entry) for entry in entries]
        for one, (scenes, entries) in read.items()
    }
    paper = staged.get(CatalogueSet.PAPER, [])
    everything = [one.entry for among in staged.values() for one in among]
    return CatalogueCheck(
        scenarios=tuple(_check(one, which) for which, among in staged.items() for one in among),
        reasons=(*_whole(everything), *find_sparse(paper)),
    )


def _staged(whole: Scene, entry: CatalogueEntry) -> StagedScenario:
    scene = whole if entry.keep_traffic else without_traffic(whole)
    return StagedScenario(entry=entry, scene=scene)


def _check(staged: StagedScenario, which: CatalogueSet) -> ScenarioCheck:
    scene, entry = staged.scene, staged.entry
    ground = Ground.of(scene)
    way = way_past(scene, entry.reference)
    if entry.intent is None:
        return ScenarioCheck(
            slug=entry.slug, statements=0, way_past=way, reasons=("it has no intent",)
        )
    reasons = [
        f"{one.severity}: {one.sentence()}"
        for one in check_against_intent(ground, entry.reference, entry.intent, AUTHORED)
        if one.is_fault
    ]
    return ScenarioCheck(
        slug=entry.slug,
        statements=len(list_statements(entry.intent)),
        way_past=way,
        reasons=(
            *reasons,
            *_unheld(entry),
            *_unparaphrased(entry),
            *_refusal(entry),
            *_unseen(scene, entry),
            *_unreached(entry),
            *(_unlikely(staged, way) if which is CatalogueSet.PAPER else ()),
        ),
    )


def _unheld(entry: CatalogueEntry) -> Iterator[str]:
    """Numbers of the sentence or a paraphrase that its intent does not hold."""
    assert entry.intent is not None
    held = set(_numbers_in(intent_to_parts(entry.intent)))
    others = {f"paraphrase {n}": one.text for n, one in enumerate(entry.paraphrases, 1)}
    for what, text in {"the instruction": entry.instruction, **others}.items():
        for number in dict.fromkeys(_NUMBER.findall(_DECIMAL_COMMA.sub(".", text))):
            if float(number) not in held:
                yield f"{what} says {number}, and its intent does not"


def _unparaphrased(entry: CatalogueEntry) -> Iterator[str]:
    """Too few paraphrases, or the same twice."""
    given = [entry.instruction, *(paraphrase.text for paraphrase in entry.paraphrases)]
    if 1 < len(given) <= FEWEST_PARAPHRASES:
        yield f"it has {len(given) - 1} paraphrases; {FEWEST_PARAPHRASES} are the fewest"
    if len({" ".join(one.casefold().split()) for one in given}) < len(given):
        yield "two of its wordings are the same"


def _refusal(entry: CatalogueEntry) -> Iterator[str]:
    """A reference that changes something about a wish that can't be met, or nothing otherwise."""
    assert entry.intent is not None
    if bool(entry.intent.unmet) is not entry.reference.is_empty:
        yield "its reference is empty where the wish can't be met, and there alone"


def _numbers_in(part: Any) -> Iterator[float]:
    if isinstance(part, dict):
        part = list(part.values())
    if isinstance(part, list):
        for one in part:
            yield from _numbers_in(one)
    elif isinstance(part, (int, float)) and not isinstance(part, bool):
        yield abs(float(part))


def _unseen(scene: Scene, entry: CatalogueEntry) -> Iterator[str]:
    camera = camera_for(scene, entry.reference)
    for agent in entry.reference.changed:
        points = agent.box.corners_m
        if agent.walk_to_m is not None:
            points = np.vstack([points, [agent.walk_to_m]])
        if not _holds(camera, points):
            yield f"{agent.id} is not wholly inside the picture"


def _unreached(entry: CatalogueEntry) -> Iterator[str]:
    """Places that prompts don't show and answers may not name."""
    for agent in entry.reference.changed:
        points = [(agent.x_m, agent.y_m), agent.walk_to_m or (0.0, 0.0)]
        if max(abs(value) for point in points for value in point) > DEFAULT_RADIUS_M:
            yield f"{agent.id} lies further than {DEFAULT_RADIUS_M:g} m off, which no prompt shows"


def _unlikely(staged: StagedScenario, way: WayPast) -> Iterator[str]:
    """What no driver would expect to meet."""
    for rule in RULES:
        yield from rule(staged)
    if way is WayPast.NONE:
        yield "it leaves no way past"


def _holds(camera: Camera, points_m: FloatArray) -> bool:
    pixels = camera.to_pixels(points_m)
    return bool((pixels >= 0.0).all() and (pixels <= [camera.width_px, camera.height_px]).all())


def _whole(entries: list[CatalogueEntry]) -> Iterator[str]:
    for scene, number in sorted(Counter(entry.scene for entry in entries).items()):
        if number > MOST_ON_ONE_SCENE:
            yield f"{scene} carries {number} scenarios, more than {MOST_ON_ONE_SCENE}"
    bare: dict[str, str] = {}
    for entry in entries:
        words = _NUMBER.sub("#", entry.instruction.casefold())
        if words in bare:
            yield f"{entry.slug} and {bare[words]} differ by numbers alone"
        bare[words] = entry.slug
