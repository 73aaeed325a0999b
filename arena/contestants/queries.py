"""The lines of a probe as a page shows them: those that are known, and those to come."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from augment.models import Contestant, EndpointModel, Probe
from augment.services.endpoints.probing import ABILITIES
from augment.services.endpoints.treatments import OPTIONS, left_out, options_of


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeLine:
    """What one question showed so far.

    Attributes:
        progress: "asked" once it is known, "asking", "waiting", or "left" where it was not asked.
        has_it: None where the answer does not tell.
    """

    ability: str
    progress: str
    has_it: bool | None = None
    note: str = ""
    model_returned: str = ""
    tokens: int | None = None
    latency_s: float | None = None
    cost_usd: Decimal | None = None


def probe_lines(model: EndpointModel, probe: Probe | None) -> list[ProbeLine]:
    """The lines of a probe; of the report that the model has where nobody asked on a page."""
    found: list[dict[str, Any]] = []
    if probe is not None:
        found = list(probe.findings)
    elif model.probe_report is not None:
        found = list(model.probe_report["findings"])
    if probe is None and not found:
        return []
    by_ability = {one["ability"]: one for one in found}
    lines: list[ProbeLine] = []
    is_next = probe is not None and probe.state == Probe.State.RUNNING
    for ability in ABILITIES:
        if ability in by_ability:
            lines.append(_line(by_ability[ability]))
        elif is_next:
            lines.append(ProbeLine(ability=ability, progress="asking"))
            is_next = False
        else:
            is_coming = probe is not None and probe.state in Probe.UNDER_WAY
            lines.append(ProbeLine(ability=ability, progress="waiting" if is_coming else "left"))
    return lines


# --- Private -----------------------------------------------------------------------------------


def _line(found: dict[str, Any]) -> ProbeLine:
    counts = (found["prompt_tokens"], found["completion_tokens"])
    cost = found["cost_usd"]
    return ProbeLine(
        ability=found["ability"],
        progress="asked",
        has_it=found["has_it"],
        note=found["note"],
        model_returned=found["model_returned"],
        tokens=None if None in counts else sum(counts),
        latency_s=found["latency_s"],
        cost_usd=None if cost is None else Decimal(cost),
    )


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
