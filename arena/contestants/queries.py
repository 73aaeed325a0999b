"""Contestants and models as pages show them: how one asks, and what a probe saw of the other."""

from dataclasses import dataclass, replace
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
    """Return the lines of a probe; of the model's report where nobody asked on a page."""
    if probe is not None:
        findings = list(probe.findings)
    else:
        findings = list((model.probe_report or {}).get("findings", ()))
    if probe is None and not findings:
        return []
    by_ability = {finding["ability"]: finding for finding in findings}
    to_come = "waiting" if probe is not None and probe.state in Probe.UNDER_WAY else "left"
    lines = [
        _probe_line(by_ability[ability])
        if ability in by_ability
        else ProbeLine(ability=ability, progress=to_come)
        for ability in ABILITIES
    ]
    if probe is not None and probe.state == Probe.State.RUNNING:
        place = next((n for n, line in enumerate(lines) if line.progress == to_come), None)
        if place is not None:
            lines[place] = replace(lines[place], progress="asking")
    return lines


def _probe_line(finding: dict[str, Any]) -> ProbeLine:
    tokens = (finding["prompt_tokens"], finding["completion_tokens"])
    cost = finding["cost_usd"]
    same = ("ability", "has_it", "note", "model_returned", "latency_s")
    return ProbeLine(
        progress="asked",
        tokens=None if None in tokens else sum(tokens),
        cost_usd=None if cost is None else Decimal(cost),
        **{name: finding[name] for name in same},
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


def asking_of(
    contestant: Contestant, made_with: dict[str, Any] | None = None
) -> dict[str, Any] | None:
    """Return a contestant's options as a page shows them, None where it asks no model.

    Args:
        contestant: Who.
        made_with: The options that an augmentation was made with, where one is shown.
    """
    if contestant.endpoint is None:
        return None
    options = made_with or options_of(contestant).to_document()
    lacking = left_out(contestant)
    lines = [
        {
            "label": LABELS[name],
            "value": _value(name, options[name]),
            "is_chosen": name in contestant.options,
            "left_out": [role for role, names in lacking.items() if name in names],
        }
        for name in OPTIONS
        if name in options
    ]
    return {"lines": lines, "is_frozen": contestant.frozen_options is not None}


def _value(name: str, value: object) -> str:
    if isinstance(value, float):
        value = f"{value:g}"
    if name == "protocol":
        return "natively" if value == "native" else "in the answer"
    units = {"max_output_tokens": "%s tokens", "radius_m": "%s m", "picture_px": "%s px"}
    return units.get(name, "%s") % value
