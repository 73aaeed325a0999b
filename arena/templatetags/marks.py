"""States as a shape, a colour and a word; numbers and money as people read them; pagers."""

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, TypeVar

from django import template
from django.core.paginator import Page
from django.http import HttpRequest
from django.template.context import Context
from django.utils.formats import number_format
from django.utils.html import format_html
from django.utils.safestring import SafeString

from arena.models import Study
from augment.models import Augmentation, GenerationJob
from augment.services.running import JobCounts
from augment.services.scenarios import film_name

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
_ICONS = {"finished": "done", "stopped_at_cap": "stop"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """Look of a state: the tone's class, the icon's template, the word."""

    tone: str
    icon: str
    label: str


@register.filter
def mark(row: Augmentation | GenerationJob | Study) -> Mark:
    """The mark of a row with a state."""
    return _mark(row.state, row.get_state_display())


@register.inclusion_tag("parts/badge.html")
def badge(tone: str, icon: str, label: str) -> dict[str, Mark]:
    """The mark of a state that no model names."""
    return {"mark": Mark(tone=tone, icon=f"icons/{icon}.svg", label=label)}


@register.filter
def has_film(picture: str) -> bool:
    """Return whether the picture of that name has a film."""
    return bool(film_name(picture))


@register.filter
def job_mark(counts: JobCounts) -> Mark:
    """The mark of a job: what broke is not green, what was cancelled may still run."""
    states, job = GenerationJob.State, counts.job
    done = counts.by_state[Augmentation.State.DONE]
    if job.state == states.FINISHED and counts.failed:
        is_all = counts.failed == counts.total
        label = "Failed" if is_all else "Finished in part"
        return Mark(tone="bad" if is_all else "warn", icon="icons/failed.svg", label=label)
    if job.state == states.FINISHED and counts.total and not done:
        label = "Finished without a modification"
        return Mark(tone="warn", icon="icons/unreadable.svg", label=label)
    running = counts.by_state[Augmentation.State.RUNNING]
    words: dict[str, str] = {states.PAUSED: "Pausing", states.CANCELLED: "Cancelled"}
    if running and job.state in words:
        label = f"{words[job.state]}, {running} running"
        return Mark(tone="busy", icon=f"icons/{job.state}.svg", label=label)
    return mark(job)


@register.filter
def mark_of(state: Augmentation.State) -> Mark:
    """The mark of an augmentation's state."""
    return _mark(state.value, str(state.label))


@register.filter
def segments(by_state: dict[Augmentation.State, int]) -> list[dict[str, Any]]:
    """A stacked bar of the states that occur; what waits stays empty, what runs comes last."""
    begun = [state for state in by_state if state != Augmentation.State.QUEUED]
    order = sorted(begun, key=lambda state: state in Augmentation.UNDER_WAY)
    total = sum(by_state.values()) or 1
    bar, start = [], 0.0
    for state in order:
        width = 100.0 * by_state[state] / total
        look = mark_of(state)
        segment = {"tone": look.tone, "label": look.label, "number": by_state[state]}
        bar.append(segment | {"start": start, "width": width})
        start += width
    return [segment for segment in bar if segment["width"]]


@register.simple_tag
def percent(part: int, whole: int) -> SafeString:
    """A share, rounded down so that 100 % means all."""
    return format_html("{}&nbsp;%", 100 * part // whole if whole else 0)


def _mark(state: str, label: str) -> Mark:
    return Mark(tone=_TONES[state], icon=f"icons/{_ICONS.get(state, state)}.svg", label=label)


_SMALLEST = Decimal("0.0001")


@register.filter
def usd(amount: Decimal | str | None) -> str:
    """An amount in dollars: in cents where it is whole ones, else to a hundredth of a cent.

    Unknown is said in words and never shown as zero.
    """
    if amount is None:
        return "unknown"
    amount = Decimal(amount)
    if amount == amount.quantize(Decimal("0.01")):
        return f"${amount:,.2f}"
    if amount < _SMALLEST:
        return "less than $0.0001"
    return f"${amount:,.4f}"


@register.filter
def grouped(number: int | None) -> str:
    """A whole number in groups of three digits; empty where there is none."""
    return "" if number is None else number_format(number, force_grouping=True)


@register.filter
def shorten(name: str, most: int = 30) -> str:
    """A long name without its middle, since both ends tell names apart."""
    end = (most - 1) // 2
    return name if len(name) <= most else f"{name[: most - 1 - end]}…{name[-end:]}"


K = TypeVar("K")
V = TypeVar("V")


@register.filter
def at(table: Mapping[K, V], key: K) -> V | None:
    """Return the table's value under a key, None if there is none."""
    return table.get(key)


@register.inclusion_tag("parts/pager.html", takes_context=True)
def pager(context: Context, page: Page[Any], name: str = "page", what: str = "") -> dict[str, Any]:
    """The way to the other pages; nothing where there is one alone.

    Args:
        context: With the request, whose address is kept but for the page.
        page: Which one is shown.
        name: What the address calls it.
        what: What is paged, for those who can't see where the links stand.
    """
    request, here = context["request"], page.number
    return {
        "what": what,
        "page": page,
        "previous": _query(request, name, here - 1) if page.has_previous() else "",
        "next": _query(request, name, here + 1) if page.has_next() else "",
    }


# --- Private -----------------------------------------------------------------------------------


def _query(request: HttpRequest, name: str, number: int) -> str:
    query = request.GET.copy()
    query[name] = str(number)
    return f"?{query.urlencode()}"
