"""Numbers and names of the results page as a person reads them."""

from __future__ import annotations

from collections.abc import Callable

from django import template

from arena.models import Vote
from arena.models.votes import AID_LABELS
from arena.rating.comparisons import Estimate
from arena.rating.lines import interval_text, rating_text, whole_percent, with_minus
from arena.results.exports.tables import Column, Row
from augment.services.judging.driving_scores import clearance_text
from augment.services.scenarios.scenes import type_label

register = template.Library()


_FORMS = {
    "csv": "CSV", "json": "JSON", "parquet": "Parquet", "latex": "LaTeX", "svg": "SVG",
    "pdf": "PDF", "png": "PNG",
}  # fmt: skip
_LEFT_OUT: dict[str, str] = {
    "superseded": "changed later",
    "check": "attention checks",
    "repeat": "hidden repeats",
    "skip": "skipped",
    "simulated": "simulated",
    "filtered": "not asked for",
    "own": "by authors on their own contestants",
}

_VERBS: dict[str, str] = {
    "open": "opened",
    "close": "closed",
    "rate": "rated",
    "rate early": "rated early",
    "rating failed": "a rating failed",
    "look early": "looked at results early",
    "hand over": "handed over",
    "plan batch": "planned a batch",
    "simulate votes": "simulated votes",
    "import votes": "imported votes",
    "mark author": "marked an author",
    "take back author": "took the mark of an author back",
}
_METHODS: dict[str, str] = {
    "bt": "Bradley-Terry on the Elo scale, a tie half a win for both",
    "davidson": "Davidson’s Bradley-Terry with ties, on the Elo scale",
    "elo": "online Elo, the median over resamples; its interval does not shrink with votes",
}
_UNITS: dict[str, str] = {
    "vote": "single votes",
    "scenario": "scenarios",
    "expert": "experts",
    "two-way": "experts and scenarios",
}


register.filter("clearance", clearance_text)


@register.filter
def forms(names: str) -> list[str]:
    """The formats of a menu, named in one string."""
    return names.split()


@register.filter
def form_label(name: str) -> str:
    """How a format is spelled."""
    return _FORMS[name]


@register.filter
def left_out(reason: str) -> str:
    """Why votes do not count; an older rating's own words stay."""
    return str(_LEFT_OUT.get(reason, reason))


@register.filter
def counted(number: int, forms: str) -> str:
    """Fill in the singular or the plural, as in `3|counted:"{} vote | {} votes"`."""
    one, many = forms.split(" | ")
    return (one if number == 1 else many).format(number)


@register.filter
def verb_label(verb: str) -> str:
    """What a line of the log is about."""
    return str(_VERBS.get(verb, verb))


register.filter(type_label)


@register.filter
def method_label(name: str) -> str:
    """What "Elo" means in this rating."""
    return str(_METHODS.get(name, name))


@register.filter
def unit_label(name: str) -> str:
    """What was resampled."""
    return str(_UNITS.get(name, name))


@register.filter
def printed(row: Row, column: Column) -> str:
    """What stands in a column of the table."""
    return minus(column.text(row))


@register.filter
def aid_labels(aids: str) -> str:
    """What an expert looked with."""
    return ", ".join(str(AID_LABELS.get(name, name)) for name in aids.split())


@register.filter
def skip_reason(reason: str) -> str:
    """Why a pair was skipped."""
    return str(dict(Vote.SkipReason.choices).get(reason, reason))


@register.filter
def percent(share: float | None) -> str:
    """A share from 0 to 1 in whole percent."""
    return "–" if share is None else f"{whole_percent(share)} %"


@register.filter
def p_value(value: float) -> str:
    """Two digits; below a hundredth only that."""
    sign, shown = ("<", 0.01) if value < 0.01 else ("=", value)
    return f"{sign} {_decimal(shown, 2)}"


@register.filter
def p_cell(value: float) -> str:
    """The same under a head that says p."""
    return p_value(value).removeprefix("= ")


@register.filter
def seconds(milliseconds: float) -> str:
    """One digit after the point."""
    return _decimal(milliseconds / 1000, 1)


@register.filter
def dollars(amount: float) -> str:
    """Four digits after the point, more where there would be none but zeros."""
    if 0 < amount < 0.0001:
        return "less than $0.0001"
    return f"${amount:,.4f}" if amount < 1 else f"${amount:,.2f}"


@register.filter
def estimate(found: Estimate | None) -> str:
    """A number with its interval: 0.31 (0.28 to 0.34)."""
    return _with_interval(found, lambda value: minus(f"{value:z.2f}"))


@register.filter
def estimate_percent(found: Estimate | None) -> str:
    """The same in percent."""
    return _with_interval(found, lambda value: f"{whole_percent(value)} %")


@register.filter
def estimate_points(found: Estimate | None) -> str:
    """The same in points, with its sign."""
    return _with_interval(found, lambda value: minus(f"{value:+.0f}") if round(value) else "0")


@register.filter
def estimate_elo(found: Estimate | None) -> str:
    """A rating in whole points, as the table prints intervals: 1012 -40/+38."""
    if not found or found.value is None:
        return "–"
    bounds = interval_text(found.value, found.lower, found.upper)
    return f"{minus(rating_text(found.value))} {minus(bounds)}"


@register.filter
def estimate_tenths(found: Estimate | None) -> str:
    """Points with one digit after the point and their sign."""
    return _with_interval(found, _change)


@register.filter
def minus(text: str) -> str:
    """A printed number with a real minus sign."""
    return with_minus(text)


def _change(value: float) -> str:
    """With its sign and one digit after the point; no sign where that is none."""
    text = f"{value:+z.1f}"
    return minus(text.removeprefix("+") if float(text) == 0.0 else text)


def _decimal(value: float, places: int) -> str:
    """Rounded; Django's own way cuts off."""
    return f"{value:.{places}f}"


def _with_interval(found: Estimate | None, written: Callable[[float], str]) -> str:
    if not found or found.value is None:
        return "unknown"
    text = written(found.value)
    if found.lower is None or found.upper is None:
        return text
    low, high = written(found.lower), written(found.upper)
    return f"{text} ({low} to {high})"


@register.filter
def percent_one(share: float | None) -> str:
    """A share from 0 to 1 in percent with one decimal; a dash where nobody knows."""
    return "–" if share is None else _decimal(100.0 * share, 1)


_METRICS: dict[str, str] = {
    "no_ego_at_fault_collisions": "No collision at fault",
    "drivable_area_compliance": "Stays on the road",
    "ego_is_making_progress": "Makes progress",
    "driving_direction_compliance": "Driving direction",
    "ego_progress_along_expert_route": "Progress along the route",
    "time_to_collision_within_bound": "Time to collision",
    "speed_limit_compliance": "Speed limit",
    "ego_is_comfortable": "Comfort",
    "lane_changes_to_goal": "Lane changes to the goal",
    "ego_passed_obstacles": "Obstacles passed",
}


@register.filter
def metric_label(name: str) -> str:
    """A part of the driving score in words."""
    return _METRICS[name]
