"""The lines of a probe as a page shows them: those that are known, and those to come."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from augment.models import EndpointModel, Probe
from augment.services.endpoints.probing import ABILITIES


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
