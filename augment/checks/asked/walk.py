"""Where pedestrians come from, where they look, and whether they cross the ego's route."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from augment.checks.asked_places import apart_m, fits_gap
from augment.checks.bodies import end_of_walk
from augment.checks.finding import Finding, FindingKind
from augment.checks.parties import Asked, severity_of, side_of
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Side, WalkRequest

_ON_ROAD_M = 1.0
"""Who begins so near the middle of the ego's lane comes from no side of it."""
_ALONG_SHARE = 0.2
"""Who looks less than this across the road (some 12 degrees) looks along it."""


def asked_walk(asked: Asked) -> Iterator[Finding]:
    """Side (a fault of logic), direction (of heading), crossing (of logic): the first one wrong.

    Of walks that cross as asked also where they end along the lane, and the gaps of a file.

    Looking or walking away from the road is a fault of the heading, as in the paper; that such a
    walk crosses nothing follows from it.
    """
    for party in asked.parties:
        if isinstance(party.request, WalkRequest):
            found = [
                (agent, _finding(asked, agent, _start(asked, agent, party.request.start)))
                for agent in party.agents
            ]
            yield from (finding for _, finding in found)
            for agent, finding in found:
                if not finding.is_fault:
                    yield from _drift(asked, agent, party.request.drift_m)
            if party.is_exact and not any(finding.is_fault for _, finding in found):
                yield from _in_file(asked, party.agents, party.request)


def _start(asked: Asked, agent: TrafficAgent, side: Side | None) -> float:
    """1 from the left, -1 from the right; where that is open, from where it begins."""
    if side is None:
        return math.copysign(1.0, asked.left_m(agent))
    return 1.0 if side is Side.LEFT else -1.0


def _drift(asked: Asked, agent: TrafficAgent, wanted_m: float | None) -> Iterator[Finding]:
    """How much further along the lane the walk ends than it begins."""
    end = end_of_walk(agent)
    if wanted_m is None or end is None:
        return
    drift_m = asked.route.locate(*end).ahead_m - asked.ahead_m(agent)
    yield Finding(
        kind=FindingKind.ASKED_DISTANCE,
        severity=severity_of(fits=abs(drift_m - wanted_m) <= asked.tolerances.drift_m),
        agents=(agent.id,),
        measured={"drift_m": drift_m, "asked_m": wanted_m},
        template=(
            f"The walk of {{agents[0]}} ends {{drift_m:.1f}} m {_along(drift_m)} along the lane; "
            f"{{asked_m:.1f}} m {_along(wanted_m)} is asked for."
        ),
    )


def _in_file(
    asked: Asked, walkers: Sequence[TrafficAgent], request: WalkRequest
) -> Iterator[Finding]:
    """How far behind the first one, who is furthest across, each of the others walks."""
    if not request.behind or request.start is None:
        return
    sign = 1.0 if request.start is Side.LEFT else -1.0
    first, *others = sorted(walkers, key=lambda one: sign * asked.left_m(one))
    if any(apart_m(*pair) < first.length_m for pair in combinations(walkers, 2)):
        return  # who stands in another is a fault of its own
    for other, wanted in zip(others, request.behind, strict=False):
        gap_m = apart_m(first, other)
        yield Finding(
            kind=FindingKind.ASKED_SPACING,
            severity=severity_of(fits=fits_gap(asked, gap_m, wanted)),
            agents=(other.id, first.id),
            measured={"gap_m": gap_m, "asked_m": wanted.middle_m},
            template=_BEHIND,
        )


def _along(drift_m: float) -> str:
    return "further" if drift_m >= 0.0 else "back"


def _finding(asked: Asked, agent: TrafficAgent, start: float) -> Finding:
    place = asked.route.locate_agent(agent)
    across = math.sin(agent.heading_rad - place.tangent_rad)
    end = end_of_walk(agent)
    end_left_m = None if end is None else asked.route.locate(*end).left_m
    to_left_m = 0.0 if end_left_m is None else end_left_m - place.left_m
    goes = math.copysign(1.0, to_left_m) if abs(to_left_m) > _ON_ROAD_M else 0.0
    is_other_side = place.left_m * start < -_ON_ROAD_M and goes == start
    measured = {"start_left_m": place.left_m, "end_left_m": end_left_m}
    begins, ends = side_of(start), side_of(-start)
    if is_other_side:
        return _fault(
            FindingKind.ASKED_SIDE, agent, measured,
            f"{{agents[0]}} crosses from the {ends} to the {begins}; from the {begins} is asked "
            "for.",
        )  # fmt: skip
    looks_away = across * start > -_ALONG_SHARE
    if looks_away or goes == start:
        measured |= {"turn_deg": math.degrees(math.asin(across))}
        return _fault(
            FindingKind.ASKED_HEADING, agent, measured,
            _away(ends, looks=looks_away),
        )  # fmt: skip
    crosses = end_left_m is not None and place.left_m * start > -_ON_ROAD_M
    if crosses and end_left_m is not None and end_left_m * start < 0.0:
        return Finding(
            kind=FindingKind.ASKED_CROSSING,
            severity=severity_of(fits=True),
            agents=(agent.id,),
            measured=measured,
            template=f"{{agents[0]}} crosses the ego's way from the {begins}, as asked for.",
        )
    return _fault(
        FindingKind.ASKED_CROSSING, agent, measured,
        f"{{agents[0]}} does not cross the ego's way from the {begins} to the {ends}.",
    )  # fmt: skip


def _away(side: str, *, looks: bool) -> str:
    if looks:
        return f"{{agents[0]}} looks away from its way to the {side} side of the road."
    return f"{{agents[0]}} walks away from its way to the {side} side of the road."


def _fault(
    kind: FindingKind, agent: TrafficAgent, measured: dict[str, float | None], words: str
) -> Finding:
    return Finding(
        kind=kind,
        severity=severity_of(fits=False),
        agents=(agent.id,),
        measured=measured,
        template=words,
    )


_BEHIND = "{agents[0]} is {gap_m:.1f} m from {agents[1]}; {asked_m:.1f} m is asked for."
