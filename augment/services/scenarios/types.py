"""Scenario types: the paper's five, and those of one's own, a slug with a label each."""

from __future__ import annotations

import re

from augment.errors import Conflict, InvalidDocument
from augment.models import Scenario
from augment.scene.entities import ScenarioType as ScenarioType
from augment.scene.entities import in_type_order as in_type_order
from augment.services.texts import one_line

LONGEST_TYPE = 40
LONGEST_LABEL = 60


def type_choices() -> list[tuple[str, str]]:
    """Every type with its label: the five in their order, then one's own by their slugs."""
    own = Scenario.objects.exclude(type_label="").order_by("type")
    labels = dict(own.values_list("type", "type_label"))
    return [*((one.value, one.label) for one in ScenarioType), *labels.items()]


def type_label(name: str) -> str:
    """What people read for a type; a type that nobody knows is its own label."""
    known = type_of(name)
    return dict(type_choices()).get(name, name) if known is None else known.label


def type_of(name: str) -> ScenarioType | None:
    """The one of the five, None for a type of one's own."""
    return ScenarioType(name) if name in list(ScenarioType) else None


def type_rank(name: str) -> int:
    """The place of one of the five in their order; one's own come behind them."""
    known = [one.value for one in ScenarioType]
    return known.index(name) if name in known else len(known)


def check_type(name: str) -> None:
    """Refuse what can't be a scenario type.

    Raises:
        InvalidDocument: It is neither one of the five nor a slug.
    """
    if type_of(name) is not None:
        return
    if len(name) > LONGEST_TYPE or not re.fullmatch(r"[a-z0-9]+([_-][a-z0-9]+)*", name):
        known = ", ".join(one.value for one in ScenarioType)
        rule = (
            f"one of {known}, or a slug of your own: lower-case letters, digits and single _ or "
            f"-, at most {LONGEST_TYPE}"
        )
        raise InvalidDocument("scenario", [("type", f"{name!r} must be {rule}")])


def label_for(name: str, label: str | None) -> str:
    """The label that a scenario of this type is stored with: empty for one of the five.

    Args:
        name: One of the five, or a slug of one's own.
        label: What people are to read; None for what the type is called already, else for the
            slug as words ("cut_in" is "Cut in").

    Raises:
        InvalidDocument: The slug or the label can't be.
        Conflict: The type is called otherwise already.
    """
    if type_of(name) is not None:
        if label:
            raise InvalidDocument("scenario", [("type_label", f"{name} has a label of its own")])
        return ""
    check_type(name)
    before = Scenario.objects.filter(type=name).values_list("type_label", flat=True).first()
    if not label:
        return before or re.sub(r"[_-]", " ", name).capitalize()
    label = one_line("type_label", label, what="scenario", longest=LONGEST_LABEL)
    if before is not None and before != label:
        raise Conflict(
            f"The scenario type {name!r} is called {before!r} already, not {label!r}; leave the "
            "label away, or choose another slug."
        )
    taken = [
        one for one, shown in type_choices() if shown.lower() == label.lower() and one != name
    ]
    if taken:
        raise Conflict(f"Another scenario type, {taken[0]!r}, is called {label!r} already.")
    return label
