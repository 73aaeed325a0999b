"""The rule placer: a contestant without a language model, which refuses rather than guesses.

It is handed the typed intent, not the sentence: what it measures is what a form would give, and
not how well anybody reads. The intent becomes places along the lanes, the places agents. Every
placement is held against the same checks that judge everybody's; where one finds something, the
placement gives way a little along the lane or is arranged otherwise, and if nothing helps, it is
refused. So is an intent that leaves open what a placement needs.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from augment.baselines.placed_things import (
    APART_M,
    BUMPER_GAP_M,
    CONE_SPACING_M,
    SLIGHT_OFFSET_M,
    cones,
    count_arrangements,
    crash,
    vehicle,
    walkers,
)
from augment.baselines.placing_ground import PlacingGround
from augment.checks import Ground, Severity
from augment.checks.lanes_across import LanesAcross, find_picked, list_absent, resolve_landmarks
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.geometry.frames import overlap
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent, TurnType, apply
from augment.scene.intent import (
    Body,
    ConesRequest,
    CrashRequest,
    Intent,
    LaneChoice,
    Lateral,
    LateralTarget,
    Length,
    Move,
    Nearness,
    Relation,
    Request,
    Shape,
    VehicleRequest,
    WalkRequest,
    resolve_anchors,
)

_Agents = tuple[TrafficAgent, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementVerdict:
    """What was found about a placement.

    Attributes:
        wrong: The first finding that hardly any instruction can mean, in words.
        doubts: How many findings are a fault unless the instruction asks for it.
    """

    wrong: str | None
    doubts: int

    @property
    def is_clean(self) -> bool:
        """Whether there is nothing but facts."""
        return self.wrong is None and self.doubts == 0


class Jury:
    """The checks on one scene; they see the request and the placement, never a reference."""

    def __init__(self, scene: Scene, route: TurnType = TurnType.STRAIGHT) -> None:
        self._scene = scene
        self._route = route
        self._ground = Ground.of(scene)

    def verdict(self, request: Request, before: _Agents, agents: _Agents) -> PlacementVerdict:
        """What is found about the agents of one request.

        Args:
            request: What they answer.
            before: Agents of earlier requests, which stand already.
            agents: Those that are judged.
        """
        everyone = number_agents((*before, *agents), self._scene)
        names = {agent.id for agent in everyone[len(before) :]}
        after = replace(self._scene, agents=(*self._scene.agents, *everyone[: len(before)]))
        ground = Ground.of(after) if before else self._ground
        own = Modification(added=tuple(agent for agent in everyone if agent.id in names))
        findings = check_against_intent(
            ground, own, Intent(requests=(request,), route=self._route)
        )
        wrong = [one.sentence() for one in findings if one.severity is Severity.WRONG]
        doubts = sum(one.severity is Severity.DOUBTFUL for one in findings)
        return PlacementVerdict(wrong=wrong[0] if wrong else None, doubts=doubts)


def number_agents(agents: _Agents, scene: Scene) -> _Agents:
    """The agents with the ids that follow the highest AgentN of the scene."""
    numbers = [
        int(agent.id.removeprefix("Agent"))
        for agent in scene.everyone
        if agent.id.removeprefix("Agent").isdecimal()
    ]
    first = max(numbers, default=0) + 1
    return tuple(
        replace(agent, id=f"Agent{number}") for number, agent in enumerate(agents, start=first)
    )


_LANES = {
    None: "the ego's lane",
    LaneChoice.OWN: "the ego's lane",
    LaneChoice.LEFT: "the lane on the left",
    LaneChoice.RIGHT: "the lane on the right",
    LaneChoice.ONCOMING: "the oncoming lane",
}


def describe(request: Request, distance_m: float, *, across_m: float) -> str:
    """One sentence: what stands where.

    Args:
        request: What was asked for.
        distance_m: Where it came to stand along the ego's lane, by its size.
        across_m: How far from the centre of its lane, for a vehicle.
    """
    relation = "ahead of" if request.spot.relation is Relation.AHEAD else "behind"
    where = (
        f"{distance_m:.1f} m {relation} the ego along its lane{_why_there(request, distance_m)}"
    )
    lane = _LANES[request.spot.lane]
    match request:
        case VehicleRequest():
            motion = f"driving at {request.speed_mps:.1f} m/s" if request.speed_mps else "standing"
            across = _across(request.spot.lateral, abs(across_m))
            return f"A {request.body}, {motion}, {where}, in {lane}, {across}."
        case WalkRequest():
            who = "A pedestrian" if request.count == 1 else f"{request.count} pedestrians"
            end = request.start.other if request.start else "other side"
            return f"{who}, {where}, crossing the road from the {request.start} to the {end}."
        case ConesRequest():
            worker = " and one worker" if request.has_worker else ""
            return f"{request.count} cones in a {request.shape}{worker}, {where}, in {lane}."
        case CrashRequest():
            plural = "buses" if request.body is Body.BUS else f"{request.body}s"
            return f"{request.count} crashed {plural}, the nearest {where}, in {lane}."


def name_of(request: Request) -> str:
    """What a request is about, in one word."""
    match request:
        case VehicleRequest():
            return "vehicles"
        case WalkRequest():
            return "pedestrians"
        case ConesRequest():
            return "cones"
        case CrashRequest():
            return "crashed vehicles"


def list_conventions(request: Request) -> Iterator[str]:
    """What fills the open parts of a request, where it is no refusal."""
    if request.spot.lane is None and not isinstance(request, WalkRequest):
        yield "in the ego's lane"
    match request:
        case VehicleRequest():
            yield from _vehicle_conventions(request)
        case WalkRequest():
            if len(request.behind) + 1 < (request.count or 0):
                yield f"{APART_M:g} m from one to the next"
        case ConesRequest():
            yield from _cone_conventions(request)
        case CrashRequest():
            yield from _crash_conventions(request)


def _vehicle_conventions(request: VehicleRequest) -> Iterator[str]:
    yield from _across_conventions(request.spot.lateral)
    if request.facing is None:
        yield "facing as the lane leads"
    if request.spacing is None and request.count != 1:
        yield f"{BUMPER_GAP_M:g} m from bumper to bumper"


def _cone_conventions(request: ConesRequest) -> Iterator[str]:
    if request.spacing is None and request.reach_m is None:
        yield f"{CONE_SPACING_M:g} m between the cones"
    if request.shape is Shape.TAPER and request.start is None:
        yield "the taper begins at the kerb's side of the lane"
    if request.has_worker and request.post is None and request.shape is not Shape.RING:
        yield "the worker stands where people do at such a shape"


def _crash_conventions(request: CrashRequest) -> Iterator[str]:
    if not any(other.turn_deg is not None for other in request.others):
        yield "the angles between them"
    if not request.others or any(other.gap is None for other in request.others):
        yield "as near as they come without sharing ground"


def _across_conventions(lateral: Lateral | None) -> Iterator[str]:
    if lateral is None:
        yield "in the middle of the lane"
    elif (
        lateral.target is not LateralTarget.LANE_CENTRE
        and lateral.offset is None
        and lateral.nearness in (None, Nearness.SLIGHTLY)
    ):
        yield f"slightly is {SLIGHT_OFFSET_M:g} m"


def _why_there(request: Request, distance_m: float) -> str:
    """A remark where the distance is not simply the one that is asked for."""
    asked = request.spot.distance
    if asked is None:
        return ""
    if asked.is_range:
        return f" (drawn from {asked})"
    if abs(distance_m - asked.low_m) > 0.01:
        return f" (moved from {asked.low_m:g} m, where it had no room)"
    return ""


def _across(lateral: Lateral | None, offset_m: float) -> str:
    if lateral is None or lateral.target is LateralTarget.LANE_CENTRE:
        return "on the lane centre"
    drawn = lateral.offset is not None and lateral.offset.is_range
    remark = f" (drawn from {lateral.offset})" if drawn else ""
    return f"{offset_m:.2f} m{remark} from the lane centre towards the {lateral.target}"


_SHIFT_STEP_M = 0.25
_SHIFT_EXACT_M = 0.5
_SHIFT_ABOUT_M = 1.5
"""How far along the lane a placement may give way, for an exact and for an "about" distance."""

NO_INTENT = "The scenario has no intent: nobody has written down what its instruction asks for."


@dataclass(frozen=True, slots=True, kw_only=True)
class Placement:
    """What was placed.

    Attributes:
        notes: What stands where and why, for a page.
    """

    modification: Modification
    notes: str


def place(scene: Scene, intent: Intent | None, *, seed: int = 0) -> Placement:
    """Add what is asked for to a scene; the same for the same seed.

    Raises:
        CannotPlace: Nobody has written down what is asked for, it leaves open what a placement
            needs, or the map or the traffic leaves no room for it.
    """
    if intent is None:
        raise CannotPlace(NO_INTENT)
    if intent.unmet:
        raise CannotPlace(f"The wish can't be met: {intent.unmet}")
    rng = np.random.default_rng(seed)
    counted, changes = _counted(scene, intent)
    sentences = [f"{name} is removed." for name in changes.removed]
    for move, agent in counted:
        in_place, distance_m = _moved(move, agent, apply(scene, changes), intent.route, rng)
        changes = replace(changes, moved=(*changes.moved, in_place))
        sentences.append(f"{agent.id} is moved to {distance_m:.1f} m along the ego's lane.")
    after = apply(scene, changes)
    ground, jury = PlacingGround(after, intent.route), Jury(after, intent.route)
    added: _Agents = ()
    for request in _counted_from_ego(scene, intent).requests:
        _insist_on_needs(request)
        agents, distance_m = _fitted(request, ground, jury, added, rng)
        added += agents
        sentences.append(describe(request, distance_m, across_m=ground.left_of_lane_m(agents[0])))
    return Placement(
        modification=replace(changes, added=number_agents(added, scene)),
        notes=_notes(sentences, intent),
    )


# Private


def _lanes_of(scene: Scene, intent: Intent) -> LanesAcross:
    lanes = LanesAcross.of(Ground.of(scene), intent.route)
    if lanes is None:
        raise CannotPlace("The ego stands on no lane of the map.")
    return lanes


def _counted_from_ego(scene: Scene, intent: Intent) -> Intent:
    """The intent with every distance from the ego."""
    return resolve_anchors(resolve_landmarks(intent, _lanes_of(scene, intent)))


def _counted(scene: Scene, intent: Intent) -> tuple[list[tuple[Move, TrafficAgent]], Modification]:
    """Who is to be moved where, and those that go."""
    lanes = _lanes_of(scene, intent)
    absent = list_absent(intent, lanes)
    if absent:
        raise CannotPlace(f"Not in this scene: {', '.join(absent)}.")
    counted = resolve_landmarks(intent, lanes).moves
    moves = [(move, find_picked(lanes, move.who)[0]) for move in counted]
    gone = [agent.id for pick in intent.removals for agent in find_picked(lanes, pick)]
    return moves, Modification(removed=tuple(dict.fromkeys(gone)))


def _moved(
    move: Move, agent: TrafficAgent, scene: Scene, route: TurnType, rng: np.random.Generator
) -> tuple[TrafficAgent, float]:
    """A road user of the scene in its new place, found as for what is added."""
    request = VehicleRequest(
        spot=move.spot,
        body=_BODIES.get(agent.type, Body.VEHICLE),
        facing=move.facing,
        turn_deg=move.turn_deg,
        speed_mps=agent.speed_mps if move.speed_mps is None else move.speed_mps,
        count=1,
    )
    _insist_on_needs(request)
    rest = replace(scene, agents=tuple(one for one in scene.agents if one.id != agent.id))
    ground, jury = PlacingGround(rest, route), Jury(rest, route)
    (moved,), distance_m = _fitted(request, ground, jury, (), rng)
    placed = replace(
        moved, id=agent.id, type=agent.type, length_m=agent.length_m, width_m=agent.width_m
    )
    return placed, distance_m


_BODIES = {AgentType.BUS: Body.BUS, AgentType.BICYCLE: Body.BICYCLE}


def _insist_on_needs(request: Request) -> None:
    for problem in list_open(request):
        raise CannotPlace(problem)


def list_open(request: Request) -> list[str]:
    """Return what a request leaves open without which nothing can be placed, a sentence each."""
    needs: dict[str, object] = {"the distance": request.spot.distance}
    match request:
        case VehicleRequest():
            needs |= {"whether they stand or how fast they drive": request.speed_mps}
        case WalkRequest():
            needs |= {"the side that they come from": request.start}
        case ConesRequest():
            needs |= {"the shape": request.shape}
    needs |= {"the count": request.count}
    return [
        f"What is asked of the {name_of(request)} leaves open {what}."
        for what, given in needs.items()
        if given is None
    ]


def _fitted(
    request: Request, ground: PlacingGround, jury: Jury, added: _Agents, rng: np.random.Generator
) -> tuple[_Agents, float]:
    """The agents of a request nearest to the asked distance that the checks pass, and it."""
    spot, wanted = request.spot, _distance(request)
    asked_m = float(rng.uniform(wanted.low_m, wanted.high_m))
    sign = 1.0 if spot.relation is Relation.AHEAD else -1.0
    draw = int(rng.integers(2**32))
    tolerance_m = _SHIFT_ABOUT_M if wanted.is_approximate else _SHIFT_EXACT_M
    first_problem = ""
    best: tuple[int, _Agents, float] | None = None
    for shift_m, arrangement in itertools.product(
        _shifts(tolerance_m), range(_count_arrangements(request))
    ):
        distance_m = asked_m + shift_m
        if wanted.is_range and not (wanted.low_m <= distance_m <= wanted.high_m):
            continue
        again = np.random.default_rng(draw)
        agents = tuple(
            _rounded(agent)
            for agent in _placed(request, ground, sign * distance_m, again, arrangement)
        )
        problem = _problem(request, ground, sign * distance_m, agents, added)
        if problem is None:
            verdict = jury.verdict(request, added, agents)
            if verdict.is_clean:
                return agents, distance_m
            if verdict.wrong is None and (best is None or verdict.doubts < best[0]):
                best = verdict.doubts, agents, distance_m
            problem = verdict.wrong
        first_problem = first_problem or problem or ""
    if best is not None:
        return best[1], best[2]
    raise CannotPlace(first_problem)


def _distance(request: Request) -> Length:
    assert request.spot.distance is not None  # `_insist_on_needs`
    return request.spot.distance


def _count_arrangements(request: Request) -> int:
    return count_arrangements(request) if isinstance(request, CrashRequest) else 1


def _shifts(tolerance_m: float) -> list[float]:
    """0, then further and further to either side."""
    steps = range(1, int(tolerance_m / _SHIFT_STEP_M) + 1)
    return [0.0, *(sign * step * _SHIFT_STEP_M for step in steps for sign in (1.0, -1.0))]


def _placed(
    request: Request,
    ground: PlacingGround,
    distance_m: float,
    rng: np.random.Generator,
    arrangement: int,
) -> _Agents:
    match request:
        case VehicleRequest():
            return vehicle(request, ground, distance_m, rng)
        case WalkRequest():
            return walkers(request, ground, distance_m, rng)
        case ConesRequest():
            return cones(request, ground, distance_m, rng)
        case CrashRequest():
            return crash(request, ground, distance_m, rng, arrangement=arrangement)


def _problem(
    request: Request, ground: PlacingGround, distance_m: float, agents: _Agents, added: _Agents
) -> str | None:
    """Why the agents can't stand there, None if they can."""
    for agent in agents:
        for other in (*ground.scene.everyone, *added):
            if overlap(agent.box, other.box).depth_m > 0.0:
                name = "the ego" if other is ground.scene.ego else other.id or "what was added"
                return f"{abs(distance_m):.1f} m from the ego it would stand in {name}."
    path_m = np.array([point for agent in agents for point in _path(agent)])
    for setting in request.spot.settings:
        if not ground.fits(distance_m, path_m, setting):
            return f"{abs(distance_m):.1f} m from the ego is not {setting}."
    return None


def _path(agent: TrafficAgent) -> NDArray[np.float64]:
    """Where an agent stands or walks, a point (P, 2) about every half metre."""
    start = np.array([agent.x_m, agent.y_m])
    end = start if agent.walk_to_m is None else np.array(agent.walk_to_m)
    return np.asarray(np.linspace(start, end, 60 if agent.walk_to_m else 1), dtype=np.float64)


def _rounded(agent: TrafficAgent) -> TrafficAgent:
    """To the millimetre, so that no digits are kept that the arithmetic alone made up."""
    walk = agent.walk_to_m
    return replace(
        agent,
        x_m=_millimetres(agent.x_m),
        y_m=_millimetres(agent.y_m),
        heading_rad=round(agent.heading_rad, 5),
        walk_to_m=None if walk is None else (_millimetres(walk[0]), _millimetres(walk[1])),
    )


def _millimetres(length_m: float) -> float:
    return round(length_m, 3) + 0.0  # + 0.0 makes -0.0 a plain zero


def _notes(sentences: list[str], intent: Intent) -> str:
    parts = list(sentences)
    conventions = list(dict.fromkeys(itertools.chain(*map(list_conventions, intent.requests))))
    if conventions:
        parts.append(f"Left open, so by convention: {'; '.join(conventions)}.")
    if intent.beyond:
        quoted = ", ".join(f"“{words}”" for words in intent.beyond)
        parts.append(f"Asked for beyond the intent's fields, and not placed: {quoted}.")
    return " ".join(parts)
