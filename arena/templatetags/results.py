"""Numbers and names of the results page as a person reads them."""

from collections.abc import Callable
from functools import partial

from django import template

from arena.models.votes import AID_LABELS
from arena.rating.agreement import share_text
from arena.rating.comparisons import Estimate
from arena.rating.lines import whole_percent, with_minus
from arena.results.exports.tables import method_text
from arena.results.queries.votes import REASONS
from augment.services.driving import clearance_text
from augment.services.scenarios import type_label

register = template.Library()

_LABELS: dict[str, dict[str, str]] = {
    "form_label": {
        "csv": "CSV",
        "json": "JSON",
        "parquet": "Parquet",
        "latex": "LaTeX",
        "svg": "SVG",
        "pdf": "PDF",
        "png": "PNG",
        "interplan": "interPlan",
        "commonroad": "CommonRoad",
        "openscenario": "OpenSCENARIO",
        "scenarionet": "ScenarioNet",
    },
    "left_out": REASONS,
    "verb_label": {
        "open": "opened",
        "close": "closed",
        "rate": "rated",
        "rate early": "rated early",
        "rating failed": "a rating failed",
        "look early": "looked at results early",
        "share results": "made a public link",
        "stop sharing results": "took the public link back",
        "hand over": "handed over",
        "plan batch": "planned a batch",
        "publish": "published a table",
        "open batch": "opened a batch",
        "simulate votes": "simulated votes",
        "import votes": "imported votes",
        "mark author": "marked an author",
        "take back author": "took the mark of an author back",
    },
    "metric_label": {
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
    },
}
"""What words of the stored data are called on pages, by the filter that says so."""


def label_of(kind: str, word: str) -> str:
    """Return the label of a word; an unknown one is its own label."""
    return _LABELS[kind].get(word, word)


for _kind in _LABELS:
    register.filter(_kind, partial(label_of, _kind))
register.filter("clearance", clearance_text)
register.filter(method_text)
register.filter("minus", with_minus)
register.filter("share", share_text)
register.filter(type_label)


@register.filter
def forms(names: str) -> list[str]:
    """The formats of a menu, named in one string."""
    return names.split()


@register.filter
def counted(number: int, forms: str) -> str:
    """Fill in the singular or the plural, as in `3|counted:"{} vote | {} votes"`."""
    singular, many = forms.split(" | ")
    return (singular if number == 1 else many).format(number)


@register.filter
def aid_labels(aids: str) -> str:
    """Return the labels of the aids that an expert used."""
    return ", ".join(str(AID_LABELS.get(name, name)) for name in aids.split())


@register.filter
def percent(share: float | None) -> str:
    """A share from 0 to 1 in whole percent."""
    return "–" if share is None else f"{whole_percent(share)} %"


@register.filter
def percent_one(share: float | None) -> str:
    """A share from 0 to 1 in percent with one decimal; a dash where nobody knows."""
    return "–" if share is None else f"{100.0 * share:.1f}"


@register.filter
def p_value(value: float) -> str:
    """Two digits; below a hundredth only that."""
    return "< 0.01" if value < 0.01 else f"= {value:.2f}"


@register.filter
def p_digits(value: float | None) -> str:
    """Four digits, or that it is less than they can show; a dash where it is unknown."""
    if value is None:
        return "–"
    return "< 0.0001" if value < 0.0001 else f"{value:.4f}"


@register.filter
def seconds(milliseconds: float) -> str:
    """One digit after the point; Django's own filter cuts off."""
    return f"{milliseconds / 1000:.1f}"


_WRITTEN: dict[str, Callable[[float], str]] = {
    "number": lambda value: with_minus(f"{value:z.2f}"),
    "percent": lambda value: f"{whole_percent(value)} %",
    "points": lambda value: with_minus(f"{value:+.0f}") if round(value) else "0",
    "tenths": lambda value: with_minus(f"{value:+.1f}") if round(value, 1) else "0.0",
}


@register.filter
def estimate(found: Estimate | None, form: str = "number") -> str:
    """A number with its interval: 0.31 (0.28 to 0.34), or in percent or points."""
    if not found or found.value is None:
        return "unknown"
    write = _WRITTEN[form]
    if found.lower is None or found.upper is None:
        return write(found.value)
    return f"{write(found.value)} ({write(found.lower)} to {write(found.upper)})"
