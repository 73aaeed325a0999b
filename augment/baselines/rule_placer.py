"""The rule placer: a contestant without a language model, which refuses rather than guesses.

It is handed the typed intent, not the sentence: what it measures is what a form would give, and
not how well anybody reads. The intent becomes places along the lanes, the places agents. Every
placement is held against the same checks that judge everybody's; where one finds something, the
placement gives way a little along the lane or is arranged otherwise, and if nothing helps, it is
refused. So is an intent that leaves open what a placement needs.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from augment.baselines.placed_motions import give_motion, is_on_other_arm
from augment.baselines.placed_people import place_cones, place_walkers
from augment.baselines.placed_vehicles import count_arrangements, place_crash, place_vehicles
from augment.baselines.placing_ground import PlacingGround
from augment.checks import Ground, Severity
from augment.checks.lanes_across import LanesAcross, find_picked, find_place, resolve_spots
from augment.checks.registry import check_against_intent
from augment.checks.wish_places import Span, find_off, list_absent, list_stations
from augment.errors import CannotPlace
from augment.geometry.frames import overlap, wrap
from augment.scene import intent as intents
from augment.scene.codec import intent_from_document, intent_to_document
from augment.scene.entities import Modification, Scene, TrafficAgent, TurnType, apply
from augment.scene.intent_parts import MotionWish
from augment.scene.numbers import draw_ranges

_SHIFT_STEP_M = 0.25
_SHIFT_EXACT_M = 0.5
_SHIFT_ABOUT_M = 1.5
"""How far along the lane a placement may give way, for an exact and for an "about" distance."""
_FROM_END_M = 20.0
"""So far from its end at most something stands where a named place has one end alone."""
_NEEDS: dict[type[intents.Request], tuple[str, str, str]] = {
    intents.VehicleRequest: ("vehicles", "speed_mps", "whether they stand or how fast they drive"),
    intents.WalkRequest: ("pedestrians", "start", "the side that they come from"),
    intents.ConesRequest: ("cones", "shape", "the shape"),
    intents.CrashRequest: ("crashed vehicles", "count", "the count"),
}
"""How a request's agents are called, and what it must say besides distance and count."""

_Agents = tuple[TrafficAgent, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Placement:
    """Objects that were placed.

    Attributes:
        notes: What stands where, for a page.
    """

    modification: Modification
    notes: str


def place(scene: Scene, intent: intents.Intent | None, *, seed: int = 0) -> Placement:
    """Add what is asked for to a scene; the same for the same seed.

    Raises:
        CannotPlace: Nobody has written down what is asked for, it leaves open what a placement
            needs, or the map or the traffic leaves no room for it.
    """
    if intent is None:
        raise CannotPlace("The scenario has no intent that says what its instruction asks for.")
    if intent.unmet:
        raise CannotPlace(f"The wish can't be met: {intent.unmet}")
    if intent.purpose is not None:
        raise CannotPlace("The wish names a purpose; rules place what has a place.")
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
        others = apply(scene, replace(changes, removed=(*changes.removed, agent.id)))
        fitting = _Fitting(others, intent.route, rng)
        request = move.as_request(agent.type)
        if request.speed_mps is None and not move.stays:
            request = replace(request, speed_mps=agent.speed_mps)
        moved, sentence = fitting.fit(request, agent if move.stays else None)
        same = {name: getattr(agent, name) for name in ("id", "type", "length_m", "width_m")}
        changes = replace(changes, moved=(*changes.moved, replace(moved[0], **same)))
        sentences.append(f"{agent.id} is moved. {sentence}")
    fitting = _Fitting(apply(scene, changes), intent.route, rng)
    named: dict[str, _Agents] = {}
    for wanted, added in zip(intent.requests, resolved.requests, strict=True):
        car = _make_car(wanted, lanes, named) if isinstance(wanted, intents.DoorRequest) else None
        agents, sentence = fitting.fit(added, car)
        named[wanted.name] = agents
        fitting.added += agents
        sentences.append(sentence)
    if intent.beyond:
        sentences.append(f"Not placed, for no field holds it: {', '.join(intent.beyond)}.")
    changes = replace(changes, added=number_agents(fitting.added, scene))
    return Placement(modification=changes, notes=" ".join(sentences))


def list_open(request: intents.Request) -> list[str]:
    """Return one sentence for each missing value without which nothing can be placed."""
    if isinstance(request, intents.DoorRequest):
        return []
    who, field, what = _NEEDS[type(request)]
    comes = isinstance(request, intents.VehicleRequest) and is_on_other_arm(request.motion)
    needs = {
        "the distance": _says_distance(request.spot) or request.spot.settings or comes,
        what: getattr(request, field),
        "the count": request.count,
    }
    return [
        f"What is asked of the {who} leaves open {what}."
        for what, value in needs.items()
        if value is None or value is False
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class FamilyMember:
    """One of a family of an intent: the same wish with numbers drawn from its ranges.

    Attributes:
        intent: With exact numbers in the place of ranges.
        modification: What the rule placer makes of it; None where nothing fits.
        refusal: Why nothing fits.
    """

    intent: intents.Intent
    modification: Modification | None = None
    refusal: str = ""


def sample_family(
    scene: Scene, intent: intents.Intent, *, count: int, seed: int = 0
) -> tuple[FamilyMember, ...]:
    """Return so many members; the first ones are the same whatever the count.

    Raises:
        CannotPlace: No number of the intent is a range.
    """
    document = intent_to_document(intent)
    if draw_ranges(document, np.random.default_rng(seed)) == document:
        raise CannotPlace("No number of the intent is a range (low_m, high_m) to draw from.")
    members = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        exact = intent_from_document(draw_ranges(document, rng))
        try:
            made = place(scene, exact, seed=int(rng.integers(2**32))).modification
        except CannotPlace as refused:
            members.append(FamilyMember(intent=exact, refusal=str(refused)))
        else:
            members.append(FamilyMember(intent=exact, modification=made))
    return tuple(members)


# Private


class _Fitting:
    """Agents fitted into one scene, request by request.

    Attributes:
        added: Agents of earlier requests, which stand already.
    """

    def __init__(self, scene: Scene, route: TurnType, rng: np.random.Generator) -> None:
        self._scene, self._ground = scene, Ground.of(scene)
        self._place, self._route, self._rng = PlacingGround(self._ground, route), route, rng
        self.added: _Agents = ()

    def fit(self, request: intents.Request, of: TrafficAgent | None = None) -> tuple[_Agents, str]:
        """Return the agents nearest to the asked distance that the checks pass, and a note.

        Args:
            request: What is asked for.
            of: Whose door it is, or who only acts anew where it is.
        """
        for open_part in list_open(request) if of is None else ():
            raise CannotPlace(open_part)
        is_said, wanted = _says_distance(request.spot), request.spot.distance
        if wanted is None or not is_said:
            wanted = intents.Length(low_m=0.0, high_m=0.0)
        asked_m = wanted.draw(self._rng)
        asked_m *= 1.0 if request.spot.relation is intents.Relation.AHEAD else -1.0
        spans_m = list_stations(request.spot, self._place.over(request.spot.via).lanes)
        is_open = wanted.is_range or not (is_said or of)
        open_m = 0.0
        if is_open and request.spot.settings:
            asked_m, open_m = _find_inside(spans_m, asked_m), _FROM_END_M / 2.0
        draw = int(self._rng.integers(2**32))
        first_problem = ""
        best: tuple[int, _Agents, float] | None = None
        for shift_m, arrangement in itertools.product(
            _shifts(wanted, open_m), range(count_arrangements(request))
        ):
            distance_m = asked_m + math.copysign(shift_m, shift_m * asked_m)
            if is_open and find_off(distance_m, spans_m) > 0.0:
                continue
            again = np.random.default_rng(draw)
            agents = self._put(request, distance_m, again, arrangement, of)
            problem, doubts = self._judge(request, distance_m, agents)
            first_problem = first_problem or problem
            if not problem and (best is None or doubts < best[0]):
                best = doubts, agents, distance_m
                if doubts == 0:
                    break
        if best is None:
            raise CannotPlace(first_problem or "Nothing of what is asked for lies there.")
        _, agents, distance_m = best
        if of is not None or not is_said:
            return agents, ""
        who = _NEEDS[type(request)][0]
        return agents, f"{who.capitalize()}: {abs(distance_m):.1f} m {request.spot.relation}."

    def _put(
        self,
        request: intents.Request,
        distance_m: float,
        rng: np.random.Generator,
        arrangement: int,
        of: TrafficAgent | None,
    ) -> _Agents:
        if of is not None:
            wish: MotionWish | None = getattr(request, "motion", None)
            if isinstance(request, intents.VehicleRequest):
                of = self._change_in_place(request, of)
            return (_round(of if wish is None else give_motion(wish, self._place, of, rng)),)
        along = self._place.over(request.spot.via)
        match request:
            case intents.VehicleRequest():
                agents = place_vehicles(request, along, distance_m, rng)
            case intents.WalkRequest():
                agents = place_walkers(request, along, distance_m, rng)
            case intents.ConesRequest():
                agents = place_cones(request, along, distance_m, rng)
            case intents.CrashRequest():
                agents = place_crash(request, along, distance_m, rng, arrangement)
            case intents.DoorRequest():
                raise AssertionError("a door is of somebody")
        return tuple(map(_round, agents))

    def _change_in_place(self, request: intents.VehicleRequest, of: TrafficAgent) -> TrafficAgent:
        """Return a road user where it is, turned and as fast as is asked for."""
        if request.speed_mps is not None:
            # Speeds of its motion would have it go on as fast as before.
            motion = of.motion and replace(of.motion, speeds=())
            of = replace(of, speed_mps=request.speed_mps, motion=motion)
        if request.facing is not None:
            lane = find_place(self._place.lanes, (of.x_m, of.y_m))
            turn_rad = math.radians(request.facing.turn_deg + request.turn_deg)
            of = replace(of, heading_rad=wrap(lane.tangent_rad + turn_rad))
        # Who stands until the end goes nowhere, and who is turned not where it went.
        stays = request.speed_mps == 0.0 and request.motion is None
        ends = request.facing is not None or stays
        return replace(of, walk_to_m=None, motion=None) if ends else of

    def _judge(
        self, request: intents.Request, distance_m: float, agents: _Agents
    ) -> tuple[str, int]:
        """Return why the agents can't stand there, "" if they can, and how much is doubtful.

        The checks see the request and the placement, never a reference.
        """
        for agent, other in itertools.product(agents, (*self._scene.everyone, *self.added)):
            if overlap(agent.box, other.box).depth_m > 0.0:
                name = "the ego" if other is self._scene.ego else other.id or "what was added"
                where = f"{abs(distance_m):.1f} m from the ego it" if distance_m else "It"
                return f"{where} would stand in {name}.", 0
        everyone = number_agents((*self.added, *agents), self._scene)
        before, own = everyone[: len(self.added)], everyone[len(self.added) :]
        ground = self._ground
        if before:
            ground = Ground.of(replace(self._scene, agents=(*self._scene.agents, *before)))
        intent = intents.Intent(requests=(request,), route=self._route)
        findings = check_against_intent(ground, Modification(added=own), intent)
        wrong = (finding.sentence() for finding in findings if finding.severity is Severity.WRONG)
        return next(wrong, ""), sum(finding.severity is Severity.DOUBTFUL for finding in findings)


def _make_car(
    request: intents.DoorRequest, lanes: LanesAcross, named: Mapping[str, _Agents]
) -> TrafficAgent:
    if request.spot.landmark is not None:
        return find_picked(lanes, request.spot.landmark)[0]
    return named[request.spot.anchor or ""][0]


def number_agents(agents: _Agents, scene: Scene) -> _Agents:
    """Return the agents with the ids that follow the highest AgentN of the scene."""
    names = [agent.id.removeprefix("Agent") for agent in scene.everyone]
    first = max((int(name) for name in names if name.isdecimal()), default=0) + 1
    return tuple(
        replace(agent, id=f"Agent{number}") for number, agent in enumerate(agents, start=first)
    )


def _says_distance(spot: intents.Spot) -> bool:
    """Return whether a number is said; past something, without one, has no end."""
    return spot.distance is not None and math.isfinite(spot.distance.high_m)


def _find_inside(spans_m: Sequence[Span], ahead_m: float) -> float:
    """Return the middle of the range of stations nearest ahead, as far as it is near its end."""
    low_m, high_m = min(spans_m, key=lambda span_m: find_off(max(ahead_m, 0.0), [span_m]))
    low_m = max(low_m, 0.0) if high_m > 0.0 else low_m
    from_m = low_m if math.isinf(high_m) else max(low_m, high_m - _FROM_END_M)
    to_m = high_m if math.isinf(low_m) else min(high_m, low_m + _FROM_END_M)
    return (from_m + to_m) / 2.0


def _shifts(wanted: intents.Length, open_m: float) -> list[float]:
    """Return 0, then further and further to either side: all of a range, or so far."""
    tolerance_m = _SHIFT_ABOUT_M if wanted.is_approximate else _SHIFT_EXACT_M
    tolerance_m = max(tolerance_m, wanted.high_m - wanted.low_m, open_m)
    steps = range(1, int(tolerance_m / _SHIFT_STEP_M) + 1)
    return [0.0, *(sign * step * _SHIFT_STEP_M for step in steps for sign in (1.0, -1.0))]


def _round(agent: TrafficAgent) -> TrafficAgent:
    """Keep millimetres, and no digits that the arithmetic alone made up."""
    x_m, y_m, *end = (
        round(value, 3) + 0.0  # + 0.0 makes -0.0 a plain zero
        for value in (agent.x_m, agent.y_m, *(agent.walk_to_m or ()))
    )
    walk_to_m = (end[0], end[1]) if end else None
    heading_rad = round(agent.heading_rad, 5)
    return replace(agent, x_m=x_m, y_m=y_m, heading_rad=heading_rad, walk_to_m=walk_to_m)
