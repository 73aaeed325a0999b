"""Marks of states: always a shape, a colour and a word."""

from __future__ import annotations

from dataclasses import dataclass

from django import template
from django.utils.html import format_html
from django.utils.safestring import SafeString
from django.utils.translation import gettext, gettext_lazy, ngettext
from django.utils.translation import gettext_noop as _

from arena.models import Study
from augment.models import Augmentation, GenerationJob
from augment.services.judging.findings import Finding
from augment.services.running.summary import JobCounts
from augment.services.wording import translate

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
_WORDS = (
    *(_("Waiting"), _("Running"), _("Done"), _("Unreadable answer"), _("Refused"), _("Failed")),
    *(_("Cancelled"), _("Finished"), _("Stopped at cap"), _("Paused"), _("Ready")),
    *(_("Draft"), _("Open"), _("Closed")),
    *(
        _("Jaywalker"),
        _("Nudge around parked vehicle"),
        _("Overtake parked vehicle"),
        _("Construction zone"),
        _("Accident site"),
    ),
    *(_("Reference"), _("Human"), _("Language model"), _("Rules"), _("Baseline")),
    *(_("Simulated"), _("Attention check")),
    *(_("The whole study"), _("Contact sheet"), _("Scenarios for interPlan")),
    *(_("added"), _("moved"), _("removed")),
    *(_("vehicle"), _("bus"), _("bicycle"), _("pedestrian"), _("traffic cone"), _("barrier")),
    *(_("construction sign"), _("generic object")),
    *(_("modifier"), _("reviewer"), _("engineer"), _("viewer")),
    *(_("Lost"), _("Released"), _("Unreadable")),
    *(_("Frontier"), _("Utility"), _("Open weight")),
    *(_("wrong"), _("doubtful"), _("position"), _("heading"), _("logic")),
)
"""What rows call their states, types, kinds and roles. Files and commands keep the English words;
pages say them in the language of whoever looks."""
_MATCHUPS = {
    "main": gettext_lazy("Votes"),
    "repeat": gettext_lazy("Hidden repeats"),
    "check": gettext_lazy("Attention checks"),
}
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
            return Mark(tone="bad", icon="icons/failed.svg", label=gettext("Failed"))
        return Mark(tone="warn", icon="icons/failed.svg", label=gettext("Finished in part"))
    if job.state == states.FINISHED and not counts.done and counts.total:
        label = gettext("Finished without a modification")
        return Mark(tone="warn", icon="icons/unreadable.svg", label=label)
    running = counts.by_state[Augmentation.State.RUNNING]
    if job.state == states.PAUSED and running:
        label = ngettext("Pausing, %(n)s still runs", "Pausing, %(n)s still run", running)
        return Mark(tone="busy", icon="icons/paused.svg", label=label % {"n": running})
    if job.state == states.CANCELLED and running:
        label = ngettext("Cancelled, %(n)s still runs", "Cancelled, %(n)s still run", running)
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
    return finding.sentence(say=translate)


@register.filter
def told_sentence(sentence: str) -> str:
    """What a service tells, in the language of whoever reads it."""
    return translate(sentence)


@register.filter
def rate(per_minute: float) -> str:
    """How many a minute: a whole number where there are ten or more."""
    return f"{per_minute:.0f}" if per_minute >= 9.95 else f"{per_minute:.1f}"


@register.filter
def duration(seconds: float) -> str:
    """How long something will take, as coarse as such a forecast is."""
    minutes = seconds / 60.0
    if minutes < 1.0:
        return gettext("a minute")
    if minutes < 90.0:
        return gettext("%(n)s min") % {"n": round(minutes)}
    if minutes < 36.0 * 60.0:
        return gettext("%(n)s h") % {"n": f"{minutes / 60.0:.1f}"}
    return gettext("%(n)s days") % {"n": f"{minutes / 1440.0:.1f}"}


@register.simple_tag
def percent(part: int, whole: int) -> SafeString:
    """A share, rounded down so that 100 % means all."""
    return format_html("{}&nbsp;%", 100 * part // whole if whole else 0)


def _mark(state: str, label: str) -> Mark:
    return Mark(
        tone=_TONES[state], icon=f"icons/{_ICONS.get(state, state)}.svg", label=gettext(label)
    )
