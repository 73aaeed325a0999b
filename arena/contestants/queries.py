"""Contestants and models as pages show them: how one asks, and what a probe saw of the other."""

from typing import Any

from augment.models import Contestant, EndpointModel, Probe
from augment.services.endpoints import OPTION_INPUTS, list_unsent_options, read_options
from augment.services.endpoints.probing import ABILITIES


def probe_lines(model: EndpointModel, probe: Probe | None) -> list[dict[str, Any]]:
    """Return a line for each ability; of the model's report where nobody asked on a page.

    `progress` is "asked" once it is known, "asking", "waiting", or "left" where it was not asked.
    """
    report = (model.probe_report or {}).get("findings", ()) if probe is None else probe.findings
    # Of several questions about one ability, the one that was not answered well is shown.
    by_success = sorted(report, key=lambda finding: finding["has_it"] is not True)
    findings = {finding["ability"]: finding for finding in by_success}
    if probe is None and not findings:
        return []
    to_come = "waiting" if probe is not None and probe.state in Probe.UNDER_WAY else "left"
    lines = [
        dict.fromkeys(("has_it", "latency_s", "cost_usd", "tokens"))
        | {"ability": ability, "progress": to_come, "note": "", "model_returned": ""}
        for ability in ABILITIES
    ]
    for line in lines:
        finding = findings.get(str(line["ability"]))
        if finding is not None:
            tokens = (finding["prompt_tokens"], finding["completion_tokens"])
            line |= {name: finding[name] for name in line.keys() & finding.keys()}
            line |= {"progress": "asked", "tokens": None if None in tokens else sum(tokens)}
    coming = next((line for line in lines if line["progress"] == "waiting"), None)
    if coming is not None and probe is not None and probe.state == Probe.State.RUNNING:
        coming["progress"] = "asking"
    return lines


def probe_state(model: EndpointModel, probe: Probe | None) -> str:
    """Return in a word what the last probe of a model came to: for pages."""
    if probe is not None and probe.state in (*Probe.UNDER_WAY, Probe.State.FAILED):
        return "failed" if probe.state == Probe.State.FAILED else "asked"
    findings = (model.probe_report or {}).get("findings", ())
    answers = {finding["ability"]: finding["has_it"] for finding in findings}.get("answers")
    return {True: "works", False: "silent", None: "unknown"}[answers]


def show_options(
    contestant: Contestant, made_with: dict[str, Any] | None = None
) -> dict[str, Any] | None:
    """Return a contestant's options as a page shows them, None where it asks no model.

    Args:
        contestant: Who.
        made_with: The options that an augmentation was made with, where one is shown.
    """
    if contestant.endpoint is None:
        return None
    options = made_with or read_options(contestant).to_document()
    lacking = list_unsent_options(contestant)
    lines = [
        {
            "label": option.label,
            "value": option.show(options[option.name]),
            "is_chosen": option.name in contestant.options,
            "left_out": [role for role, names in lacking.items() if option.name in names],
        }
        for option in OPTION_INPUTS
        if option.name in options
    ]
    return {"lines": lines, "is_frozen": contestant.frozen_options is not None}
