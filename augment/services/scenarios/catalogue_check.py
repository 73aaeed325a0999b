"""Whether the catalogue's references are what their intents ask for, and can be shown.

Those of the paper set are also held against what a driver expects (`catalogue_rules`).

Reads files, touches no rows.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path

import numpy as np

from augment.checks import Ground
from augment.checks.ground import VEHICLES, gaps_m, is_stopped
from augment.checks.lanes_across import LanesAcross, find_mark
from augment.checks.parties import AUTHORED
from augment.checks.registry import check_against_intent
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

MOST_ON_ONE_SCENE = 8
FEWEST_PARAPHRASES = 3
"""Of a scenario that has any."""
TOUCH_M = 0.1
"""The widest gap between cars that have crashed."""
NEAR_JUNCTION_M = 10.0
"""Somebody who names a place so near before a junction names the junction."""
HIDDEN_SHARE, TRAFFIC_SHARE, ONCOMING_SHARE = 0.5, 0.7, 0.7
"""Of a set's jaywalkers, scenarios and overtakes."""
FEWEST_OTHERS = 3
CLEARANCE_M = 0.3
"""On either side of the ego, as it passes."""
EDGE_M = 0.25
"""So far over the edge of its lane the ego is still in it."""
_AT_EDGE_M, _WAVER_M, _SIGHT_M = 0.6, 0.05, 0.02
_FURTHEST_M, _STEP_M, _ALONG_M = 9.0, 0.1, 2.0
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_JUNCTION = re.compile(r"intersection|junction|crossing|crossroads|side street", re.IGNORECASE)
_HIDING = {Setting.BY_PARKED_LEFT, Setting.BY_PARKED_RIGHT}


class WayPast(StrEnum):
    """By which lane the ego gets past, the best first."""

    OWN = "own lane"
    BESIDE = "lane beside it"
    ONCOMING = "oncoming lane"
    NONE = "none"


_RANK = list(WayPast).index


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
        """Return what the reference adds of these types."""
        return [one for one in self.entry.reference.added if one.type in types]

    def ahead_m(self, agent: TrafficAgent) -> float:
        """Return how far along the ego's route an agent is."""
        assert self.lanes is not None
        return self.lanes.route.locate_agent(agent).ahead_m

    def left_m(self, agent: TrafficAgent) -> float:
        """Return how far left of the ego's route an agent is."""
        assert self.lanes is not None
        return self.lanes.route.locate_agent(agent).left_m

    def shows(self, points_m: FloatArray) -> bool:
        """Return whether the picture holds all of these points (P, 2)."""
        pixels = self.camera.to_pixels(points_m)
        size = [self.camera.width_px, self.camera.height_px]
        return bool((pixels >= 0.0).all() and (pixels <= size).all())


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
    staged: dict[CatalogueSet, list[StagedScenario]] = {}
    for which in sets:
        scenes, entries = read_catalogue(folder_of(folder, which))
        shown = {True: scenes, False: {name: without_traffic(scenes[name]) for name in scenes}}
        staged[which] = [
            StagedScenario(entry=one, scene=shown[one.keep_traffic][one.scene]) for one in entries
        ]
    entries = [one.entry for among in staged.values() for one in among]
    return CatalogueCheck(
        scenarios=tuple(_check(one, which) for which, among in staged.items() for one in among),
        reasons=(*_find_alike(entries), *find_sparse(staged.get(CatalogueSet.PAPER, []))),
    )


def _check(staged: StagedScenario, which: CatalogueSet) -> ScenarioCheck:
    entry = staged.entry
    way = way_past(staged.scene, entry.reference)
    reasons = ["it has no intent"]
    if entry.intent is not None:
        findings = check_against_intent(
            Ground.of(staged.scene), entry.reference, entry.intent, AUTHORED
        )
        reasons = [f"{one.severity}: {one.sentence()}" for one in findings if one.is_fault]
        reasons += [*_find_wrong_words(entry), *_find_unseen(staged)]
        if bool(entry.intent.unmet) is not entry.reference.is_empty:
            reasons.append("its reference is empty where the wish can't be met, and there alone")
        if which is CatalogueSet.PAPER:
            reasons += [reason for rule in RULES for reason in rule(staged)]
            reasons += ["it leaves no way past"] if way is WayPast.NONE else []
    return ScenarioCheck(
        slug=entry.slug,
        statements=0 if entry.intent is None else len(list_statements(entry.intent)),
        way_past=way,
        reasons=tuple(reasons),
    )


def _find_wrong_words(entry: CatalogueEntry) -> Iterator[str]:
    """Numbers that the intent does not hold; too few paraphrases, or the same twice."""
    assert entry.intent is not None
    held = {abs(float(one)) for one in _NUMBER.findall(json.dumps(intent_to_parts(entry.intent)))}
    wordings = {"the instruction": entry.instruction}
    wordings |= {f"paraphrase {n}": one.text for n, one in enumerate(entry.paraphrases, 1)}
    for what, text in wordings.items():
        decimal = re.sub(r"(?<=\d),(?=\d)", ".", text)
        for number in dict.fromkeys(_NUMBER.findall(decimal)):
            if float(number) not in held:
                yield f"{what} says {number}, and its intent does not"
    if 0 < len(entry.paraphrases) < FEWEST_PARAPHRASES:
        yield f"it has {len(entry.paraphrases)} paraphrases; {FEWEST_PARAPHRASES} are the fewest"
    if len({" ".join(one.casefold().split()) for one in wordings.values()}) < len(wordings):
        yield "two of its wordings are the same"


def _find_unseen(staged: StagedScenario) -> Iterator[str]:
    """What lies outside of the picture, or where prompts don't show and answers may not name."""
    for agent in staged.entry.reference.changed:
        places_m = np.array([(agent.x_m, agent.y_m), agent.walk_to_m or (agent.x_m, agent.y_m)])
        if not staged.shows(np.vstack([agent.box.corners_m, places_m])):
            yield f"{agent.id} is not wholly inside the picture"
        if np.abs(places_m).max() > DEFAULT_RADIUS_M:
            yield f"{agent.id} lies further than {DEFAULT_RADIUS_M:g} m off, which no prompt shows"


def _find_alike(entries: list[CatalogueEntry]) -> Iterator[str]:
    for scene, number in sorted(Counter(entry.scene for entry in entries).items()):
        if number > MOST_ON_ONE_SCENE:
            yield f"{scene} carries {number} scenarios, more than {MOST_ON_ONE_SCENE}"
    bare: dict[str, str] = {}
    for entry in entries:
        words = _NUMBER.sub("#", entry.instruction.casefold())
        if words in bare:
            yield f"{entry.slug} and {bare[words]} differ by numbers alone"
        bare[words] = entry.slug


# What somebody who drives expects of a scenario, apart from what its sentence asks for


def find_apart(one: StagedScenario) -> Iterator[str]:
    """Yield crashed vehicles of which one touches none before it."""
    cars = one.added(*VEHICLES) if one.entry.type is ScenarioType.ACCIDENT_SITE else []
    if not cars:
        return
    gaps = gaps_m(np.array([car.box.corners_m for car in cars]))
    for number, car in enumerate(cars[1:], start=1):
        gap_m = gaps[number, :number].min()
        if gap_m > TOUCH_M:
            yield f"{car.id} has crashed into nobody: {gap_m:.2f} m off"


def find_unguarded(one: StagedScenario) -> Iterator[str]:
    """Yield roadworks without sign, barrier or worker, or in an order that guards nobody."""
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
    lefts = [one.left_m(cone) for cone in cones]
    band = one.lanes.band(LaneChoice.OWN, one.ahead_m(cones[0]))
    if band is not None and abs(abs(lefts[0]) - band.width_m / 2.0) > _AT_EDGE_M:
        yield f"its first cone stands {abs(lefts[0]):.1f} m off the lane centre, not at an edge"
    steps = np.diff(lefts)
    if (steps > _WAVER_M).any() and (steps < -_WAVER_M).any():
        yield "its cones lead to both sides"


def find_unnamed_junction(one: StagedScenario) -> Iterator[str]:
    """Yield what stands in, past or right before a junction that the wish does not name."""
    intent = one.entry.intent
    if one.lanes is None or intent is None or not one.entry.reference.added:
        return
    first = one.entry.reference.added[0]
    start_m = find_mark(one.lanes, MapPlace.JUNCTION_START)
    end_m = find_mark(one.lanes, MapPlace.JUNCTION_END)
    ahead_m, half_m = one.ahead_m(first), first.length_m / 2.0
    spots = [request.spot for request in intent.requests]
    if any(spot.mark is not None for spot in spots) or start_m is None or end_m is None:
        return
    if ahead_m + half_m <= start_m - NEAR_JUNCTION_M:
        return
    place = Setting.IN_INTERSECTION
    if ahead_m - half_m >= end_m:
        place = Setting.AFTER_INTERSECTION
    elif ahead_m + half_m <= start_m:
        place = Setting.BEFORE_INTERSECTION
    wanted = {place, Setting.AT_INTERSECTION}
    if not wanted & {setting for spot in spots for setting in spot.settings}:
        yield f"its intent does not say that it is {min(wanted)}"
    if one.entry.language == ENGLISH and not _JUNCTION.search(one.entry.instruction):
        yield "its sentence names no junction"


def find_unhidden(one: StagedScenario) -> Iterator[str]:
    """Yield walkers who step out from behind something in the sentence, and are in full view."""
    intent = one.entry.intent
    if intent is None or one.entry.type is not ScenarioType.JAYWALKER:
        return
    hides = {setting for request in intent.requests for setting in request.spot.settings}
    if (hides & _HIDING or one.added(*VEHICLES)) and not is_hidden(one):
        yield "its jaywalker is to come from behind something and is in full view"


RULES = (find_apart, find_unguarded, find_unnamed_junction, find_unhidden)


def find_sparse(staged: list[StagedScenario]) -> Iterator[str]:
    """Yield shares of a set that are too low for what people drive through."""
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


def is_hidden(one: StagedScenario) -> bool:
    """Return whether a vehicle stands between the ego and where the first walk begins."""
    walkers = [walker for walker in one.entry.reference.added if walker.walk_to_m is not None]
    if not walkers:
        return False
    ego, walker = one.scene.ego, walkers[0]
    dx_m, dy_m = walker.x_m - ego.x_m, walker.y_m - ego.y_m
    middle = Pose(
        x_m=ego.x_m + dx_m / 2.0, y_m=ego.y_m + dy_m / 2.0, heading_rad=math.atan2(dy_m, dx_m)
    )
    sight = Box(pose=middle, length_m=math.hypot(dx_m, dy_m), width_m=_SIGHT_M)
    return any(
        overlap(sight, car.box).area_m2 > 0.0
        for car in (*one.scene.agents, *one.entry.reference.added)
        if car.type in VEHICLES and is_stopped(car)
    )


def _shown(one: StagedScenario) -> list[TrafficAgent]:
    """Whose centres the picture shows."""
    return [car for car in one.scene.agents if one.shows(np.array([[car.x_m, car.y_m]]))]


def _drives(agent: TrafficAgent) -> bool:
    return agent.type in VEHICLES and not is_stopped(agent)


def has_traffic(one: StagedScenario) -> bool:
    """Return whether the picture shows a few others, and one of them drives."""
    seen = _shown(one)
    return len(seen) >= FEWEST_OTHERS and any(map(_drives, seen))


def has_oncoming(one: StagedScenario) -> bool:
    """Return whether the picture shows somebody who drives towards the ego in that lane."""
    if one.lanes is None:
        return False
    for other in filter(_drives, _shown(one)):
        band = one.lanes.band(LaneChoice.ONCOMING, one.ahead_m(other))
        if band is not None and abs(one.left_m(other) - band.left_m) < band.width_m / 2.0:
            return True
    return False


# The way past what stands on the road. s runs along the ego's route, d to the left of it.


def way_past(scene: Scene, change: Modification) -> WayPast:
    """Return the first of own lane, lane beside it and oncoming lane that is wide enough.

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
    spots = {
        one.id: np.array([(p.ahead_m, p.left_m) for p in map(route.locate, *one.box.corners_m.T)])
        for one in standing
    }
    own = np.vstack([block for name, block in spots.items() if name in changed])[:, 0]
    start_m, end_m = own.min() - EGO_LENGTH_M, own.max() + EGO_LENGTH_M
    beside = [
        block[:, 1]
        for block in spots.values()
        if block[:, 0].min() < end_m and block[:, 0].max() > start_m
    ]
    half_m = EGO_WIDTH_M / 2.0 + CLEARANCE_M
    stations_m = np.arange(start_m, end_m, _ALONG_M).tolist()
    ways = [
        _find_worst(ground, route, offset_m, stations_m)
        for offset_m in np.arange(-_FURTHEST_M, _FURTHEST_M + _STEP_M, _STEP_M).tolist()
        if all(offset_m + half_m <= d.min() or offset_m - half_m >= d.max() for d in beside)
    ]
    return min(ways, key=_RANK, default=WayPast.NONE)


def _find_worst(
    ground: Ground, route: EgoRoute, offset_m: float, stations_m: Sequence[float]
) -> WayPast:
    """The worst that lies under the ego's sides and middle at that offset."""
    half_m = EGO_WIDTH_M / 2.0 - EDGE_M
    worst = WayPast.OWN
    for s_m in stations_m:
        for left_m in (offset_m - half_m, offset_m, offset_m + half_m):
            worst = max(worst, _find_under(ground, route, s_m, left_m), key=_RANK)
            if worst is WayPast.NONE:
                return worst
    return worst


def _find_under(ground: Ground, route: EgoRoute, ahead_m: float, left_m: float) -> WayPast:
    x_m, y_m = route.position(ahead_m, left_m)
    if ground.road.distance_m(x_m, y_m) > 0.0 or ground.carparks.distance_m(x_m, y_m) == 0.0:
        return WayPast.NONE
    lanes = [one for one in ground.graph.beside(x_m, y_m) if one.covers]
    if not lanes or any(one.lane_id in route.lane_ids for one in lanes):
        return WayPast.OWN
    tangent_rad = route.heading_at(ahead_m)
    turns = [abs(difference(one.tangent_rad, tangent_rad)) for one in lanes]
    return WayPast.BESIDE if min(turns) < math.pi / 4.0 else WayPast.ONCOMING
