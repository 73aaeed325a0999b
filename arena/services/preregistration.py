"""The file in which a study says what it will do, frozen before its first vote.

It names nobody: experts are numbers, in the order of their names, so that forgetting somebody
later leaves no trace here. Its SHA-256 stands in every export of the study.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from typing import Any

from django.conf import settings

from arena.models import Study
from arena.rating.snapshot_document import VERSION as RESULTS_VERSION
from arena.results.services.vote_files import VERSION as VOTES_VERSION
from arena.services.study_plan import SWITCH_COLUMNS
from augment.models import Contestant, Scenario
from augment.services.endpoints.treatments import options_of

FORMAT, VERSION = "scenario-arena/preregistration", 1
FILE_NAME = "preregistration.json"
_ELSEWHERE = frozenset({"entries", "experts", "hypotheses", "stopping", "jobs", "options"})
"""Rules that have a place of their own in the file, or name people."""


def preregister(study: Study) -> None:
    """Freeze the file of a study that was just planned; in the transaction of its opening."""
    study.preregistration = _text(_document(study))
    study.save(update_fields=["preregistration"])


def preregistration_bytes(study: Study) -> bytes:
    """The file, empty for studies that were opened before there was one, or from a file."""
    return study.preregistration.encode()


def preregistration_sha256(study: Study) -> str:
    """The hash of the file, empty where there is none."""
    content = preregistration_bytes(study)
    return hashlib.sha256(content).hexdigest() if content else ""


def product_version() -> str:
    """Of this installation."""
    with (settings.BASE_DIR / "pyproject.toml").open("rb") as file:
        return str(tomllib.load(file)["project"]["version"])


# --- Private -----------------------------------------------------------------------------------


def _document(study: Study) -> dict[str, Any]:
    rules = study.rules
    contestants = study.contestants.select_related("endpoint").order_by("slug")
    return {
        "format": FORMAT,
        "version": VERSION,
        "product": {
            "name": "scenario-arena",
            "version": product_version(),
            "planner": rules["planner"],
            "results": RESULTS_VERSION,
            "votes": VOTES_VERSION,
        },
        "study": {"name": study.name, "code": str(study.code)},
        "opened_at": study.opened_at.isoformat() if study.opened_at else None,
        "seed": study.seed,
        "experts": len(rules["experts"]),
        "votes_planned": len(rules["experts"]) * study.votes_per_expert,
        "rules": {name: kept for name, kept in rules.items() if name not in _ELSEWHERE},
        "choices": {name.removeprefix("allow_"): getattr(study, name) for name in SWITCH_COLUMNS},
        "contestants": [_contestant(one) for one in contestants],
        "scenarios": [_scenario(one) for one in study.scenarios.order_by("slug")],
        "jobs": rules["jobs"],
        "pictures": rules["entries"],
        "plan": _plan(study),
        "hypotheses": rules["hypotheses"],
        "analysis": {
            "method": "Bradley-Terry on the Elo scale, ties half a win, mean 1000",
            "intervals": "95 %, two-way over experts and scenarios, closed form",
            "pairs": "all judged at once, 5 % for the whole table",
            "settled_pairs": "ties, as many a pair as others have votes on average",
            "left_out": "hidden repeats, attention checks, skips, superseded votes",
        },
    }


def _contestant(one: Contestant) -> dict[str, Any]:
    return {
        "slug": one.slug,
        "name": one.name,
        "kind": one.kind,
        "variant": one.variant,
        "model": one.model,
        "roles": one.roles,
        "options": options_of(one).to_document() if one.endpoint else None,
    }


def _scenario(one: Scenario) -> dict[str, Any]:
    return {"slug": one.slug, "type": one.type, "instruction": one.instruction}


def _plan(study: Study) -> dict[str, Any]:
    """The planned showings as one hash: expert's number, place, kind, scenario, left, right."""
    numbers = {name: number for number, name in enumerate(sorted(study.rules["experts"]), 1)}
    rows = study.matchups.values_list(
        *("expert__username", "position", "kind", "scenario__slug"),
        *("left__contestant__slug", "left__sample"),
        *("right__contestant__slug", "right__sample"),
    )
    lines = sorted((numbers[name], *rest) for name, *rest in rows)
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    return {
        "matchups": len(lines),
        "planned_later": sum(study.votes_to_plan.values()),
        "sha256": hashlib.sha256(text.encode()).hexdigest(),
    }


def _text(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=1, ensure_ascii=False, sort_keys=True) + "\n"
