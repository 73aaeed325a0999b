"""Marks of states: always a shape, a colour and a word."""

from __future__ import annotations

from dataclasses import dataclass

from django import template
from django.utils.html import format_html
from django.utils.safestring import SafeString

from arena.models import Study
from augment.models import Augmentation, GenerationJob
from augment.services.judging.findings import Finding
from augment.services.running.progress import JobCounts

register = template.Library()

_TONES = {
    "queued": "quiet",
    "running": "busy",
    "done": "good",
    "finished": "good",
    "stopped_at_cap": "warn",
    "paused": "warn",
    "unreadable": "warn",
    "refused": "warn",
    "failed": "bad",
    "cancelled": "quiet",
    "draft": "quiet",
    "open": "busy",
    "closed": "good",
}
_MATCHUPS = {"main": "Votes", "repeat": "Hidden repeats", "check": "Attention checks"}
_ICONS = {"finished": "done", "stopped_at_cap": "stop"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """How a state looks: the tone's class, the icon's template, the word."""

    tone: str
    icon: str
    label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BarSegment:
    """A part of a stacked bar, in percent of its width."""

    tone: str
    label: str
    number: int
    start: float
    width: float


@register.filter
def mark(row: Augmentation | GenerationJob | Study) -> Mark:
    """The mark of a row with a state."""
    return _mark(row.state, row.get_state_display())


@register.filter
def job_mark(counts: JobCounts) -> Mark:
    """The mark of a job: what broke is not green, what was cancelled may still run."""
    states, job = GenerationJob.State, counts.job
    if job.state == states.FINISHED and counts.failed:
        if counts.failed == counts.total:
            return Mark(tone="bad", icon="icons/failed.svg", label="Failed")
        return Mark(tone="warn", icon="icons/failed.svg", label="Finished in part")
    if job.state == states.FINISHED and not counts.done and counts.total:
        label = "Finished without a modification"
        return Mark(tone="warn", icon="icons/unreadable.svg", label=label)
    running = counts.by_state[Augmentation.State.RUNNING]
    if job.state == states.PAUSED and running:
        label = "Pausing, %(n)s still runs" if running == 1 else "Pausing, %(n)s still run"
        return Mark(tone="busy", icon="icons/paused.svg", label=label % {"n": running})
    if job.state == states.CANCELLED and running:
        label = "Cancelled, %(n)s still runs" if running == 1 else "Cancelled, %(n)s still run"
        return Mark(tone="busy", icon="icons/cancelled.svg", label=label % {"n": running})
    return mark(job)


@register.filter
def matchups_label(kind: str) -> str:
    """What matchups of a kind are called."""
    return str(_MATCHUPS[kind])


@register.filter
def mark_of(state: Augmentation.State) -> Mark:
    """The mark of an augmentation's state."""
    return _mark(state.value, str(state.label))


@register.filter
def segments(by_state: dict[Augmentation.State, int]) -> list[BarSegment]:
    """A stacked bar of the states that occur; what waits stays empty, what runs comes last."""
    begun = [state for state in by_state if state != Augmentation.State.QUEUED]
    order = sorted(begun, key=lambda state: state in Augmentation.UNDER_WAY)
    total = sum(by_state.values()) or 1
    found, start = [], 0.0
    for state in order:
        width = 100.0 * by_state[state] / total
        if width:
            look = _mark(state.value, str(state.label))
            found.append(
                BarSegment(
                    tone=look.tone,
                    label=look.label,
                    number=by_state[state],
                    start=start,
                    width=width,
                )
            )
        start += width
    return found


@register.filter
def say_finding(finding: Finding) -> str:
    """What a check found, with its numbers; agents and lanes go by their ids."""
    return finding.sentence()


@register.filter
def rate(per_minute: float) -> str:
    """How many a minute: a whole number where there are ten or more."""
    return f"{per_minute:.0f}" if per_minute >= 9.95 else f"{per_minute:.1f}"


@register.filter
def duration(seconds: float) -> str:
    """How long something will take, as coarse as such a forecast is."""
    minutes = seconds / 60.0
    if minutes < 1.0:
        return "a minute"
    if minutes < 90.0:
        return f"{round(minutes)} min"
    if minutes < 36.0 * 60.0:
        return f"{minutes / 60.0:.1f} h"
    return f"{minutes / 1440.0:.1f} days"


@register.simple_tag
def percent(part: int, whole: int) -> SafeString:
    """A share, rounded down so that 100 % means all."""
    return format_html("{}&nbsp;%", 100 * part // whole if whole else 0)


def _mark(state: str, label: str) -> Mark:
    return Mark(tone=_TONES[state], icon=f"icons/{_ICONS.get(state, state)}.svg", label=label)
