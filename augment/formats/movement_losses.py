"""The lines about motion that every format with motion shares."""

from __future__ import annotations

from augment.formats.writing import Cell, LossReport
from augment.scene.motion import SETS_OUT_WITHIN_M, MotionSource, Movement


def report_motion(cell: Cell, report: LossReport, *, can_trigger: bool = False) -> None:
    """Say what of the motion was assumed, and what was fixed that depends on the ego.

    Args:
        cell: What is written.
        report: Gets the lines.
        can_trigger: Whether the format can let people set out when the ego comes near.
    """
    motion = cell.motion
    if motion.ego.source is MotionSource.HELD_SPEED:
        report.lose("the ego was not recorded; it is let hold its speed along its lane")
    elif motion.ego.source is MotionSource.STANDING:
        report.lose("the ego was not recorded; it stands, as it does at t0")
    elif cell.drive is None and cell.recording is not None:
        unseen = ~cell.recording.ego_is_seen
        if unseen.any():
            report.lose(
                f"the ego was not recorded at {unseen.sum()} of {len(unseen)} steps; it goes "
                "straight across gaps, and holds its last speed after the last step"
            )
    names = [other.agent.id for other in motion.others if other.source is MotionSource.HELD_SPEED]
    report.lose_of(names, "not recorded; let hold the speed of t0 along the lane, or straight on")
    walkers = [other for other in motion.others if other.agent.walk_to_m is not None]
    if cell.drive is not None:
        return
    names = [walker.agent.id for walker in walkers if walker.stands]
    report.lose_of(
        names,
        f"has a walk but stands: the ego never comes within {SETS_OUT_WITHIN_M:g} m",
        changes_scene=True,
    )
    if can_trigger:
        return
    for walker in walkers:
        if not walker.stands:
            at_s = motion.times_s[int((walker.states[:, 3] > 0.0).argmax())]
            report.lose(
                f"{walker.agent.id} sets out {at_s:g} s after t0, whatever the ego does; "
                f"with us it does when the ego is within {SETS_OUT_WITHIN_M:g} m"
            )


def appears_later(movement: Movement) -> bool:
    """Whether an agent is not there yet at t0."""
    return not bool(movement.is_present[0])


def has_gaps(movement: Movement) -> bool:
    """Whether an agent goes and comes back."""
    present = movement.is_present
    return bool((present[1:] & ~present[:-1]).sum() > (0 if present[0] else 1))
