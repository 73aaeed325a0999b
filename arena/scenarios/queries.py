"""Scenarios as pages show them."""

import math
import uuid
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from django.contrib.auth.models import User
from django.db.models import Case, Count, Q, QuerySet, When

from arena.shell.accounts import top_role
from arena.shell.forms import TypeGroup
from augment.models import Augmentation, Benchmark, Contestant, Scenario, Submission
from augment.services import motion_in_words
from augment.services.benchmarks import Split, Stratum, public_origins
from augment.services.scenarios import type_choices

OWN = "own"
"""The scenarios that are in no set of the catalogue."""


def list_scenarios(chosen: str = "", *, is_retired: bool = False) -> QuerySet[Scenario]:
    """Return scenarios by type and slug, without the documents of their scenes.

    Args:
        chosen: A set of the catalogue, `own` for those in none; empty for all.
        is_retired: Those that forms offer no more, instead of the others.
    """
    rows = Scenario.objects.filter(retired_at__isnull=not is_retired).select_related("base_scene")
    if chosen:
        rows = rows.filter(catalogue_set="" if chosen == OWN else chosen)
    lean = rows.defer("reference", "base_scene__document", "base_scene__recording")
    return lean.order_by("type", "slug")


def by_type(chosen: str = "") -> list[TypeGroup]:
    """Return the choices of a set, in the order of the types."""
    return group_by_type(list(list_scenarios(chosen)))


def group_by_type(rows: list[Scenario]) -> list[TypeGroup]:
    """Return rows in groups, in the order of the types."""
    groups = [
        TypeGroup(type=name, label=label, scenarios=[row for row in rows if row.type == name])
        for name, label in type_choices()
    ]
    return [group for group in groups if group.scenarios]


def set_choices(chosen: str) -> list[dict[str, Any]]:
    """Return all scenarios first (named by the empty text), then the sets that there are."""
    rows = list_scenarios().filter(paraphrase_of=None).order_by()
    numbers = Counter(name or OWN for name in rows.values_list("catalogue_set", flat=True))
    present = {"": sum(numbers.values())} | {
        name: numbers[name] for name in (*Scenario.SETS, OWN) if numbers.get(name)
    }
    return [
        {"name": name, "number": number, "is_chosen": name == chosen}
        for name, number in present.items()
    ]


def set_asked(name: str | None) -> str:
    """Return the set that an address asks for; all where it names none."""
    return name if name is not None and name in {*Scenario.SETS, OWN} else ""


def reference_pictures(scenarios: Sequence[Scenario]) -> dict[int, uuid.UUID]:
    """Return, by scenario, the youngest augmentation that draws its reference."""
    rows = Augmentation.objects.filter(
        scenario__in=scenarios,
        contestant__kind=Contestant.Kind.REFERENCE,
        state=Augmentation.State.DONE,
    )
    return dict(rows.order_by("created_at", "pk").values_list("scenario_id", "code"))


def list_augmentations(scenario: Scenario) -> list[Augmentation]:
    """Return every augmentation of a scenario with a picture, the youngest job first."""
    rows = scenario.augmentations.filter(state__in=Augmentation.SHOWABLE).exclude(image="")
    return list(
        rows.select_related("contestant", "job")
        .defer("modification")
        .order_by("-job__created_at", "contestant__name")
    )


def modification_lines(document: dict[str, Any] | None) -> list[dict[str, Any]]:
    """Return a line for each agent that a stored modification adds, moves or removes.

    Frame: ego frame, x forward and y left in metres.
    """
    parts = document or {}
    changed = [("added", agent) for agent in parts.get("add", ())]
    changed += [("moved", agent) for agent in parts.get("move", ())]
    lines = [
        agent
        | {
            "change": change,
            "agent": agent["id"],
            "kind": agent["type"].replace("_", " ").lower(),
            "heading_deg": math.degrees(agent["heading_rad"]),
            "moves": motion_in_words(agent),
        }
        for change, agent in changed
    ]
    removed = parts.get("remove", ())
    return lines + [{"change": "removed", "agent": name, "x_m": None} for name in removed]


def step_changes(before: dict[str, Any] | None, after: dict[str, Any] | None) -> list[str]:
    """Return a sentence for each agent that a step of a conversation treats otherwise.

    Args:
        before: The stored modification of the step before.
        after: That of the step.
    """
    old, new = (
        {line["agent"]: line for line in modification_lines(document)}
        for document in (before, after)
    )
    sentences = [f"{name} no longer {old[name]['change']}" for name in old if name not in new]
    for name, line in new.items():
        was = old.get(name)
        if was is None or was["change"] != line["change"]:
            kind = f": {line['kind']}" if "kind" in line else ""
            sentences.append(f"{name} {line['change']}{kind}")
        elif was != line and (differences := list(_differences(was, line))):
            sentences.append(f"{name}: {', '.join(differences)}")
    return sentences


def _differences(was: dict[str, Any], line: dict[str, Any]) -> Iterator[str]:
    apart_m = math.dist((was["x_m"], was["y_m"]), (line["x_m"], line["y_m"]))
    turned_deg = (line["heading_deg"] - was["heading_deg"] + 180.0) % 360.0 - 180.0
    if apart_m >= 0.005:
        yield f"{apart_m:.2f} m away"
    if was["kind"] != line["kind"]:
        yield f"a {line['kind']}"
    if abs(turned_deg) >= 0.05:
        yield f"turned by {turned_deg:.1f}°"
    ignored = {"x_m", "y_m", "kind", "type", "heading_deg", "heading_rad", "lane_id", "moves"}
    for name in sorted((was.keys() | line.keys()) - ignored):
        if was.get(name) != line.get(name):
            yield f"another {name.removesuffix('_m').removesuffix('_mps').replace('_', ' ')}"


# --- Benchmarks --------------------------------------------------------------------------------


def list_benchmarks() -> QuerySet[Benchmark]:
    """Return all with their tasks, and how many are public, the newest version of a name first."""
    is_public = Q(items__split=Split.TEST, items__scenario__origin__in=public_origins())
    rows = Benchmark.objects.annotate(
        tasks=Count("items"),
        practice=Count("items", filter=Q(items__split=Split.PRACTICE)),
        public=Count("items", filter=is_public),
    )
    return rows.order_by("slug", "-version")


def count_tasks(tasks: Iterable[tuple[str, str]]) -> dict[str, dict[str, int]]:
    """Return how many tasks each split has, by stratum and of all.

    Args:
        tasks: Split and stratum of each.
    """
    counts = Counter(tasks)
    lines = {
        stratum.value.capitalize(): {split.value: counts[split, stratum] for split in Split}
        for stratum in Stratum
    }
    return lines | {
        "All": {split.value: sum(line[split.value] for line in lines.values()) for split in Split}
    }


# --- Submissions -------------------------------------------------------------------------------

_AWAITED = Q(state=Submission.State.CHECKED, decision=Submission.Decision.NONE)


def submissions_for(user: User, *, with_report: bool = False) -> QuerySet[Submission]:
    """Return the submissions that an account may see: its own, all for staff; awaited first."""
    role = top_role(user)
    rows = Submission.objects.select_related("benchmark", "uploaded_by__person", "contestant")
    rows = rows if with_report else rows.defer("report")
    if role in ("admin", "researcher"):
        return rows.annotate(is_awaited=Case(When(_AWAITED, then=1), default=0)).order_by(
            "-is_awaited", "-pk"
        )
    return rows.filter(uploaded_by=user) if role == "entrant" else rows.none()


def is_waiting(row: Submission) -> bool:
    """Return whether a submission waits for a decision."""
    return row.state == Submission.State.CHECKED and not row.is_decided


def count_waiting() -> int:
    """Count the submissions that wait for a decision."""
    return Submission.objects.filter(_AWAITED).count()
