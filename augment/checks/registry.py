"""Every check of a modification, and the functions that run them.

In: a `Scene`, a `Modification`, and what its instruction asks for where that is stored.
Out: `Finding`s, each a measured fact with its numbers, its severity and the class of fault that
it speaks for. Nothing else is looked at: never a reference, never anybody's label.

Adding a check is adding one function to `CHECKS`, which never ask what was wanted, or to
`ASKED_CHECKS`.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from augment.checks import (
    asked_motions,
    asked_places,
    asked_things,
    bodies,
    motions,
    places,
    purpose,
)
from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.ground import ChangedScene, Ground
from augment.checks.lanes_across import LanesAcross
from augment.checks.parties import USUAL, AskedCheck, Case, Tolerances, assign_parties
from augment.scene.entities import Modification
from augment.scene.intent import Intent, VehicleRequest

CHECKS: tuple[places.Check, ...] = (
    *(places.lane, places.lane_named, places.heading, places.walk_heading, bodies.walk_blocked),
    *(places.off_road, bodies.overlap, bodies.size, bodies.speed, motions.motion_trigger),
    *(motions.motion_start, motions.motion_limits, motions.motion_off_road),
    motions.motion_blocked,
)
ASKED_CHECKS: tuple[AskedCheck, ...] = (
    *(asked_things.check_count, asked_things.check_type, asked_places.check_distance),
    *(asked_places.check_across, asked_things.check_heading, asked_places.check_crash),
    *(asked_things.check_walk, asked_things.check_motion, asked_places.check_spacing),
    *(asked_things.check_changes, asked_motions.check_course, purpose.check_purpose),
)
_OF_PLACE = frozenset(
    {
        *(FindingKind.HEADING, FindingKind.WALK_HEADING, FindingKind.OFF_ROAD),
        *(FindingKind.MOTION_START, FindingKind.MOTION_OFF_ROAD),
    }
)


def findings_on(ground: Ground, modification: Modification) -> tuple[Finding, ...]:
    """Measure every added and moved agent, agent by agent; of what is removed nothing is measured.

    Raises:
        InvalidModification: The modification does not fit the scene.
    """
    situation = ChangedScene.of(ground, modification)
    findings = [finding for check in CHECKS for finding in check(situation)]
    order = {agent.id: number for number, agent in enumerate(situation.changed)}
    return tuple(sorted(findings, key=lambda finding: order[finding.agents[0]]))


def check_against_intent(
    ground: Ground,
    modification: Modification,
    intent: Intent | None,
    tolerances: Tolerances = USUAL,
) -> tuple[Finding, ...]:
    """Return the findings of all checks, those on the instruction first, then agent by agent.

    Args:
        ground: Of the scene before the change.
        modification: The change.
        intent: What the instruction asks for; None where nobody has written it down. Then only
            the checks that need none are made.
        tolerances: How far off what is asked for something may be.

    Raises:
        InvalidModification: The modification does not fit the scene.
    """
    alone = findings_on(ground, modification)
    lanes = None if intent is None else LanesAcross.of(ground, intent.route)
    if intent is None or lanes is None:
        return alone
    asked = assign_parties(ground, modification, intent, lanes, tolerances)
    remaining = [
        finding for check in ASKED_CHECKS for case in _by_way(asked) for finding in check(case)
    ]
    return (*remaining, *_drop_answered(alone, remaining, asked))


def _by_way(asked: Case) -> Iterator[Case]:
    """The case of the intent's route with all changes, then one for each other way's parties."""
    everyone, nobody, case = asked.parties, frozenset[str](), asked
    for via in dict.fromkeys((None, *(party.request.spot.via for party in everyone))):
        lanes = asked.lanes.over(via)
        assert lanes is not None, "spots without a way are left open"
        parties = tuple(party for party in everyone if party.request.spot.via == via)
        yield replace(case, lanes=lanes, parties=parties)
        case = replace(case, modification=Modification(), to_move=nobody, to_remove=nobody)
        case = replace(case, surplus=())


def _drop_answered(
    alone: Iterable[Finding], findings: Iterable[Finding], case: Case
) -> Iterable[Finding]:
    """The findings of the checks that ask for nothing, now that it is known what was asked for.

    What is doubtful "unless the instruction asks for it" is a fact where it does: a heading
    against the lane of who has been held against a request; half off the road, of a car whose
    place across it has been, or of what stands where that belongs which it is taken for. Where
    and how a thing stands that nobody asked for is no fault of its own.
    """
    answering = {agent.id for agent in case.modification.changed if case.purpose is not None}
    placed = set(answering)
    for party in case.parties:
        placed.update(agent.id for agent, _ in party.mistyped)
        if not isinstance(party.request, VehicleRequest) or party.request.spot.lane is not None:
            answering.update(agent.id for agent in party.everyone)
    for finding in findings:
        if finding.kind in (FindingKind.ASKED_ACROSS, FindingKind.ASKED_SIDE):
            placed.update(finding.agents)
        if finding.kind is FindingKind.ASKED_HEADING:
            answering.update(finding.agents)
    surplus = {agent.id for agent in case.surplus}
    for finding in alone:
        name, is_doubtful = finding.agents[0], finding.severity is Severity.DOUBTFUL
        is_settled = (
            (finding.kind is FindingKind.HEADING and name in answering)
            or (finding.kind is FindingKind.OFF_ROAD and is_doubtful and name in placed)
            or (finding.kind in _OF_PLACE and name in surplus)
        )
        yield replace(finding, severity=Severity.FACT) if is_settled else finding
