"""The options of a contestant as people read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from augment.models import Contestant
from augment.services.endpoints.treatments import OPTIONS, left_out, options_of

LABELS = {
    "temperature": "Temperature",
    "seed": "Seed",
    "reasoning_effort": "Reasoning effort",
    "max_output_tokens": "Longest answer",
    "protocol": "Calls of the function",
    "rounds": "Rounds at most",
    "accepted_from": "Content from a mean rating of",
    "radius_m": "Radius",
    "prompt_version": "Prompt version",
    "picture_px": "Width of the viewer’s picture",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class OptionLine:
    """One option.

    Attributes:
        is_chosen: Whether somebody chose it when the contestant was added.
        left_out: Roles whose models do not take it.
    """

    label: str
    value: str
    is_chosen: bool
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Asking:
    """All options that a contestant has."""

    lines: tuple[OptionLine, ...]
    is_frozen: bool


def asking_of(contestant: Contestant, made_with: dict[str, Any] | None = None) -> Asking | None:
    """How a contestant asks, None where it asks no model.

    Args:
        contestant: Who.
        made_with: The options that an augmentation was made with, where one is shown.
    """
    if contestant.endpoint is None:
        return None
    options = made_with or options_of(contestant).to_document()
    lacking = left_out(contestant)
    return Asking(
        lines=tuple(
            OptionLine(
                label=str(LABELS[name]),
                value=_value(name, options[name]),
                is_chosen=name in contestant.options,
                left_out=tuple(role for role, names in lacking.items() if name in names),
            )
            for name in OPTIONS
            if name in options
        ),
        is_frozen=contestant.frozen_options is not None,
    )


def _value(name: str, value: object) -> str:
    if isinstance(value, float):
        value = f"{value:g}"
    if name == "protocol":
        return "natively" if value == "native" else "in the answer"
    units = {"max_output_tokens": "%s tokens", "radius_m": "%s m", "picture_px": "%s px"}
    return units.get(name, "%s") % value
