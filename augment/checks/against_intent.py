"""All checks of a modification, with what an instruction asks for where that is stored.

The scene, the modification and the intent are all that is looked at: never a reference, never
anybody's label.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from augment.checks.asked.across import asked_across
from augment.checks.asked.crash import asked_crash
from augment.checks.asked.distance import asked_distance
from augment.checks.asked.heading import asked_heading
from augment.checks.asked.parties import Party, match_to_requests
from augment.checks.asked.question import Asked, AskedCheck
from augment.checks.asked.spacing import asked_spacing
from augment.checks.asked.things import (
    asked_changes,
    asked_count,
    asked_motion,
    asked_type,
    find_attempted,
    find_unasked,
)
from augment.checks.asked.walk import asked_walk
from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.ground import Ground
from augment.checks.landmarks import find_picked, resolve_landmarks
from augment.checks.lanes_across import LanesAcross
from augment.checks.registry import findings_on
from augment.checks.tolerances import USUAL, Tolerances
from augment.scene.entities import Modification
from augment.scene.intent import Intent, Move, VehicleRequest, resolve_anchors

ASKED_CHECKS: tuple[AskedCheck, ...] = (
    asked_count,
    asked_type,
    asked_distance,
    asked_across,
    asked_heading,
    asked_crash,
    asked_walk,
    asked_motion,
    asked_spacing,
    asked_changes,
    find_unasked,
    find_attempted,
)


def check_against_intent(
    ground: Ground,
    modification: Modification,
    intent: Intent | None,
    tolerances: Tolerances = USUAL,
) -> tuple[Finding, ...]:
    """What was measured, what was asked for first, then agent by agent.

    Args:
        ground: Of the scene before the change.
        modification: The change.
        intent: What the instruction asks for; None where nobody has written it down. Then only
            the checks that need none are made.
        tolerances: How far off what is asked for something may be.

    Raises:
        InvalidModification: The modification does not fit the scene.
    """
    findings = findings_on(ground, modification)
    lanes = None if intent is None else LanesAcross.of(ground, intent.route)
    if intent is None or lanes is None:
        return findings
    asked = _asked(modification, intent, lanes, tolerances)
    held = [one for check in ASKED_CHECKS for one in check(asked)]
    return (*held, *_settled(findings, held, asked))


def _asked(
    modification: Modification, intent: Intent, lanes: LanesAcross, tolerances: Tolerances
) -> Asked:
    """The modification with who answers what; a move is a request for one vehicle elsewhere."""
    counted = resolve_anchors(resolve_landmarks(intent, lanes))
    matching = match_to_requests(counted, modification.added, lanes)
    moved = {one.id: one for one in modification.moved}
    picked = [(move, agent.id) for move in counted.moves for agent in find_picked(lanes, move.who)]
    movers = [
        Party(request=_as_request(move), agents=(moved[name],))
        for move, name in picked
        if name in moved
    ]
    return Asked(
        modification=modification,
        lanes=lanes,
        matching=replace(matching, parties=(*matching.parties, *movers)),
        tolerances=tolerances,
        to_move=frozenset(name for _, name in picked),
        to_remove=frozenset(
            agent.id for pick in intent.removals for agent in find_picked(lanes, pick)
        ),
        unmet=intent.unmet,
    )


def _as_request(move: Move) -> VehicleRequest:
    return VehicleRequest(
        spot=move.spot,
        facing=move.facing,
        turn_deg=move.turn_deg,
        speed_mps=move.speed_mps,
        count=1,
    )


def _settled(found: Iterable[Finding], held: Iterable[Finding], asked: Asked) -> Iterable[Finding]:
    """The findings of the checks that ask for nothing, now that it is known what was asked for.

    What is doubtful "unless the instruction asks for it" is a fact where it does: a heading
    against the lane of who has been held against a request; half off the road, of a car whose
    place across it has been, or of what stands where that belongs which it is taken for. Where
    and how a thing stands that nobody asked for is no fault of its own.
    """
    mistyped = {agent.id for party in asked.parties for agent, _ in party.mistyped}
    answering = {
        agent.id
        for party in asked.parties
        for agent in party.everyone
        if not isinstance(party.request, VehicleRequest) or party.request.spot.lane is not None
    }
    surplus = {agent.id for agent in asked.matching.surplus}
    across = {
        name
        for one in held
        if one.kind in (FindingKind.ASKED_ACROSS, FindingKind.ASKED_SIDE)
        for name in one.agents
    }
    for one in found:
        name = one.agents[0]
        is_settled = (
            (one.kind is FindingKind.HEADING and name in answering)
            or (
                one.kind is FindingKind.OFF_ROAD
                and one.severity is Severity.DOUBTFUL
                and name in across | mistyped
            )
            or (one.kind in _OF_PLACE and name in surplus)
        )
        yield replace(one, severity=Severity.FACT) if is_settled else one


_OF_PLACE = frozenset(
    {FindingKind.HEADING, FindingKind.DEGREES, FindingKind.WALK_HEADING, FindingKind.OFF_ROAD}
)
