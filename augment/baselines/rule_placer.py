"""The rule placer: a contestant without a language model, which refuses rather than guesses.

It is handed the typed intent, not the sentence: what it measures is what a form would give, and
not how well anybody reads. The intent becomes places along the lanes, the places agents. Every
placement is held against the same checks that judge everybody's; where one finds something, the
placement gives way a little along the lane or is arranged otherwise, and if nothing helps, it is
refused. So is an intent that leaves open what a placement needs.
"""

import itertools
from dataclasses import dataclass, replace

import numpy as np

from augment.baselines.placed_people import APART_M, CONE_SPACING_M, place_cones, place_walkers
from augment.baselines.placed_vehicles import (
    BUMPER_GAP_M,
    SLIGHT_OFFSET_M,
    count_arrangements,
    place_crash,
    place_vehicles,
)
from augment.baselines.placing_ground import PlacingGround
from augment.checks import Ground, Severity
from augment.checks.lanes_across import LanesAcross, find_picked, list_absent, resolve_spots
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
    Nearness,
    Relation,
    Request,
    Shape,
    VehicleRequest,
    WalkRequest,
)

_SHIFT_STEP_M = 0.25
_SHIFT_EXACT_M = 0.5
_SHIFT_ABOUT_M = 1.5
"""How far along the lane a placement may give way, for an exact and for an "about" distance."""
NO_INTENT = "The scenario has no intent: nobody has written down what its instruction asks for."
_BODIES = {AgentType.BUS: Body.BUS, AgentType.BICYCLE: Body.BICYCLE}
_NAMES = {
    VehicleRequest: "vehicles",
    WalkRequest: "pedestrians",
    ConesRequest: "cones",
    CrashRequest: "crashed vehicles",
}

_Agents = tuple[TrafficAgent, ...]


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
    lanes = LanesAcross.of(Ground.of(scene), intent.route)
    if lanes is None:
        raise CannotPlace("The ego stands on no lane of the map.")
    absent = list_absent(intent, lanes)
    if absent:
        raise CannotPlace(f"Not in this scene: {', '.join(absent)}.")
    resolved = resolve_spots(intent, lanes)
    gone = [agent.id for pick in intent.removals for agent in find_picked(lanes, pick)]
    changes = Modification(removed=tuple(dict.fromkeys(gone)))
    sentences = [f"{name} is removed." for name in changes.removed]
    for move in resolved.moves:
        agent = find_picked(lanes, move.who)[0]
        request = VehicleRequest(
            spot=move.spot,
            body=_BODIES.get(agent.type, Body.VEHICLE),
            facing=move.facing,
            turn_deg=move.turn_deg,
            speed_mps=agent.speed_mps if move.speed_mps is None else move.speed_mps,
            count=1,
        )
        others = tuple(one for one in apply(scene, changes).agents if one.id != agent.id)
        fitting = _Fitting(replace(scene, agents=others), intent.route, rng)
        (moved,), distance_m = fitting.fit(request)
        same = {name: getattr(agent, name) for name in ("id", "type", "length_m", "width_m")}
        changes = replace(changes, moved=(*changes.moved, replace(moved, **same)))
        sentences.append(f"{agent.id} is moved to {distance_m:.1f} m along the ego's lane.")
    fitting = _Fitting(apply(scene, changes), intent.route, rng)
    for added in resolved.requests:
        agents, distance_m = fitting.fit(added)
        fitting.added += agents
        sentences.append(_describe(added, distance_m, fitting.left_of_lane_m(agents[0])))
    conventions = list(dict.fromkeys(itertools.chain(*map(_conventions, intent.requests))))
    if conventions:
        sentences.append(f"Left open, so by convention: {'; '.join(conventions)}.")
    if intent.beyond:
        quoted = ", ".join(f"“{words}”" for words in intent.beyond)
        sentences.append(f"Asked for beyond the intent's fields, and not placed: {quoted}.")
    changes = replace(changes, added=_numbered(fitting.added, scene))
    return Placement(modification=changes, notes=" ".join(sentences))


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
        f"What is asked of the {_NAMES[type(request)]} leaves open {what}."
        for what, given in needs.items()
        if given is None
    ]


# Private


class _Fitting:
    """Agents fitted into one scene, request by request.

    Attributes:
        added: Agents of earlier requests, which stand already.
    """

    def __init__(self, scene: Scene, route: TurnType, rng: np.random.Generator) -> None:
        self._place, self._route, self._rng = PlacingGround(scene, route), route, rng
        self._scene, self._ground = scene, Ground.of(scene)
        self.added: _Agents = ()

    def fit(self, request: Request) -> tuple[_Agents, float]:
        """The agents of a request nearest to the asked distance that the checks pass, and it."""
        for open_part in list_open(request):
            raise CannotPlace(open_part)
        wanted = request.spot.distance or Length(low_m=0.0, high_m=0.0)
        asked_m = wanted.drawn(self._rng)
        sign = 1.0 if request.spot.relation is Relation.AHEAD else -1.0
        draw = int(self._rng.integers(2**32))
        arrangements = count_arrangements(request) if isinstance(request, CrashRequest) else 1
        first_problem = ""
        best: tuple[int, _Agents, float] | None = None
        for shift_m, arrangement in itertools.product(_shifts(wanted), range(arrangements)):
            distance_m = asked_m + shift_m
            if wanted.is_range and not (wanted.low_m <= distance_m <= wanted.high_m):
                continue
            again = np.random.default_rng(draw)
            agents = self._placed(request, sign * distance_m, again, arrangement)
            problem = self._problem(request, sign * distance_m, agents)
            if problem is None:
                problem, doubts = self._verdict(request, agents)
                if problem is None and doubts == 0:
                    return agents, distance_m
                if problem is None and (best is None or doubts < best[0]):
                    best = doubts, agents, distance_m
            first_problem = first_problem or problem or ""
        if best is not None:
            return best[1], best[2]
        raise CannotPlace(first_problem)

    def left_of_lane_m(self, agent: TrafficAgent) -> float:
        """How far an agent stands left of the centre of its lane, 0 off every lane."""
        if agent.lane_id is None:
            return 0.0
        line = self._ground.graph.lane(agent.lane_id).centerline
        return line.project(agent.x_m, agent.y_m).d_m

    def _placed(
        self, request: Request, distance_m: float, rng: np.random.Generator, arrangement: int
    ) -> _Agents:
        """To the millimetre, so that no digits are kept that the arithmetic alone made up."""
        ground = self._place
        match request:
            case VehicleRequest():
                agents = place_vehicles(request, ground, distance_m, rng)
            case WalkRequest():
                agents = place_walkers(request, ground, distance_m, rng)
            case ConesRequest():
                agents = place_cones(request, ground, distance_m, rng)
            case CrashRequest():
                agents = place_crash(request, ground, distance_m, rng, arrangement=arrangement)
        return tuple(
            replace(
                agent,
                x_m=_millimetres(agent.x_m),
                y_m=_millimetres(agent.y_m),
                heading_rad=round(agent.heading_rad, 5),
                walk_to_m=agent.walk_to_m
                and (_millimetres(agent.walk_to_m[0]), _millimetres(agent.walk_to_m[1])),
            )
            for agent in agents
        )

    def _problem(self, request: Request, distance_m: float, agents: _Agents) -> str | None:
        """Why the agents can't stand there, None if they can."""
        ego = self._scene.ego
        for agent, other in itertools.product(agents, (*self._scene.everyone, *self.added)):
            if overlap(agent.box, other.box).depth_m > 0.0:
                name = "the ego" if other is ego else other.id or "what was added"
                return f"{abs(distance_m):.1f} m from the ego it would stand in {name}."
        path_m = np.vstack([_path(agent) for agent in agents])
        for setting in request.spot.settings:
            if not self._place.fits(distance_m, path_m, setting):
                return f"{abs(distance_m):.1f} m from the ego is not {setting}."
        return None

    def _verdict(self, request: Request, agents: _Agents) -> tuple[str | None, int]:
        """The first finding that hardly any instruction can mean, and how many are doubtful.

        The checks see the request and the placement, never a reference.
        """
        everyone = _numbered((*self.added, *agents), self._scene)
        before, own = everyone[: len(self.added)], everyone[len(self.added) :]
        ground = self._ground
        if before:
            ground = Ground.of(replace(self._scene, agents=(*self._scene.agents, *before)))
        intent = Intent(requests=(request,), route=self._route)
        findings = check_against_intent(ground, Modification(added=own), intent)
        wrong = (one.sentence() for one in findings if one.severity is Severity.WRONG)
        return next(wrong, None), sum(one.severity is Severity.DOUBTFUL for one in findings)


def _numbered(agents: _Agents, scene: Scene) -> _Agents:
    """The agents with the ids that follow the highest AgentN of the scene."""
    names = [agent.id.removeprefix("Agent") for agent in scene.everyone]
    first = max((int(name) for name in names if name.isdecimal()), default=0) + 1
    return tuple(
        replace(agent, id=f"Agent{number}") for number, agent in enumerate(agents, start=first)
    )


def _shifts(wanted: Length) -> list[float]:
    """0, then further and further to either side."""
    tolerance_m = _SHIFT_ABOUT_M if wanted.is_approximate else _SHIFT_EXACT_M
    steps = range(1, int(tolerance_m / _SHIFT_STEP_M) + 1)
    return [0.0, *(sign * step * _SHIFT_STEP_M for step in steps for sign in (1.0, -1.0))]


def _path(agent: TrafficAgent) -> np.typing.NDArray[np.float64]:
    """Where an agent stands or walks, a point (P, 2) about every half metre."""
    start = np.array([agent.x_m, agent.y_m])
    return np.linspace(start, agent.walk_to_m or start, 60 if agent.walk_to_m else 1)


def _millimetres(length_m: float) -> float:
    return round(length_m, 3) + 0.0  # + 0.0 makes -0.0 a plain zero


def _describe(request: Request, distance_m: float, left_m: float) -> str:
    """One sentence: what stands where along the ego's lane."""
    relation = "ahead of" if request.spot.relation is Relation.AHEAD else "behind"
    asked, why = request.spot.distance, ""
    if asked is not None and asked.is_range:
        why = f" (drawn from {asked})"
    elif asked is not None and abs(distance_m - asked.low_m) > 0.01:
        why = f" (moved from {asked.low_m:g} m, where it had no room)"
    where = f"{distance_m:.1f} m {relation} the ego along its lane{why}"
    lane = f"the {request.spot.lane or LaneChoice.OWN} lane"
    match request:
        case VehicleRequest():
            motion = f"driving at {request.speed_mps:.1f} m/s" if request.speed_mps else "standing"
            across = _across(request.spot.lateral, abs(left_m))
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


def _across(lateral: Lateral | None, offset_m: float) -> str:
    if lateral is None or lateral.target is LateralTarget.LANE_CENTRE:
        return "on the lane centre"
    is_drawn = lateral.offset is not None and lateral.offset.is_range
    remark = f" (drawn from {lateral.offset})" if is_drawn else ""
    return f"{offset_m:.2f} m{remark} from the lane centre towards the {lateral.target}"


def _conventions(request: Request) -> list[str]:
    """What fills the open parts of a request, where it is no refusal."""
    lateral = request.spot.lateral
    is_walk = isinstance(request, WalkRequest)
    rules = [(request.spot.lane is None and not is_walk, "in the ego's lane")]
    match request:
        case VehicleRequest():
            is_open_row = request.spacing is None and request.count != 1
            rules += [
                (lateral is None, "in the middle of the lane"),
                (_is_slight(lateral), f"slightly is {SLIGHT_OFFSET_M:g} m"),
                (request.facing is None, "facing as the lane leads"),
                (is_open_row, f"{BUMPER_GAP_M:g} m from bumper to bumper"),
            ]
        case WalkRequest():
            is_open_row = len(request.behind) + 1 < (request.count or 0)
            rules += [(is_open_row, f"{APART_M:g} m from one to the next")]
        case ConesRequest():
            is_open_row = request.spacing is None and request.reach_m is None
            is_open_taper = request.shape is Shape.TAPER and request.start is None
            is_open_post = request.has_worker and request.post is None
            rules += [
                (is_open_row, f"{CONE_SPACING_M:g} m between the cones"),
                (is_open_taper, "the taper begins at the kerb's side of the lane"),
                (
                    is_open_post and request.shape is not Shape.RING,
                    "the worker stands where people do at such a shape",
                ),
            ]
        case CrashRequest():
            turns = [other.turn_deg is not None for other in request.others]
            gaps = [other.gap is not None for other in request.others]
            rules += [
                (not any(turns), "the angles between them"),
                (not (gaps and all(gaps)), "as near as they come without sharing ground"),
            ]
    return [words for holds, words in rules if holds]


def _is_slight(lateral: Lateral | None) -> bool:
    if lateral is None or lateral.target is LateralTarget.LANE_CENTRE:
        return False
    return lateral.offset is None and lateral.nearness in (None, Nearness.SLIGHTLY)
