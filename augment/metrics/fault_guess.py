"""A first guess of the faults that an expert would see, from the checks alone."""

from collections.abc import Iterable

from augment.checks.finding import FaultClass, Finding, FindingKind

__all__ = ["FaultClass", "first_guess"]

_FOLLOWS_PLACE = frozenset(
    {
        FindingKind.OVERLAP,
        FindingKind.WALK_BLOCKED,
        FindingKind.MOTION_BLOCKED,
        FindingKind.ASKED_CROSSING,
        FindingKind.LANE_NAMED,
    }
)


def first_guess(findings: Iterable[Finding]) -> frozenset[FaultClass]:
    """The classes in which something was found wrong or doubtful, by its cause.

    A fault counts once, where it begins. The paper's heading errors are those of agents whose
    position is about right; so at a wrong place the heading, a contact with somebody who is in
    the right place and a walk that crosses nothing follow from the place. A contact and a
    walk that leads through something may also follow from a wrong heading. Two that are both
    misplaced and overlap do so on their own account.
    """
    faults = [finding for finding in findings if finding.is_fault]
    # A wrong place comes first: what follows from it is no fault of its own.
    misplaced = _names(faults, FaultClass.POSITION)
    turned = {name for name in _names(faults, FaultClass.HEADING) if name not in misplaced}
    return frozenset(fault.fault for fault in faults if not _follows(fault, misplaced, turned))


def _names(faults: Iterable[Finding], fault: FaultClass) -> set[str]:
    return {name for finding in faults if finding.fault is fault for name in finding.agents}


def _follows(finding: Finding, misplaced: set[str], turned: set[str]) -> bool:
    if finding.fault is FaultClass.HEADING:
        return bool(finding.agents) and finding.agents[0] in misplaced
    if finding.kind is FindingKind.WALK_BLOCKED and turned.intersection(finding.agents):
        return True
    if finding.kind is FindingKind.OVERLAP:
        # One of the two is misplaced: the overlap follows from that. Both are: it is their own.
        is_alone = len(misplaced.intersection(finding.agents)) == 1
        return is_alone or bool(turned.intersection(finding.agents))
    return finding.kind in _FOLLOWS_PLACE and bool(misplaced.intersection(finding.agents))
