"""Benchmark sets: made of scenarios, version by version, and read as values.

A version is what its scenarios were when it was made. While it is not retired, what it hands out
of them stays; rows that changed nevertheless no longer fit its checksum, and whoever asks is told.
"""

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from uuid import UUID

import numpy as np
from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.db.models import F, Max, QuerySet, prefetch_related_objects
from django.utils import timezone

from augment.benchmark.folder import MOST_TASKS, checksum
from augment.benchmark.folder import write_folder as write_folder
from augment.benchmark.strata import SplitCandidate, choose_strata, measure_task, split_tasks
from augment.benchmark.values import BenchmarkSet, BenchmarkTask
from augment.benchmark.values import Split as Split
from augment.benchmark.values import Stratum as Stratum
from augment.errors import Conflict, UnknownName
from augment.models import Benchmark, BenchmarkItem, Scenario
from augment.scene.codec import recording_from_document
from augment.scene.entities import Modification
from augment.services.events import log_change
from augment.services.inputs import InputKind, check_bounds, input_field
from augment.services.scenarios import scenes
from augment.services.scenarios.choosing import resolve_scenarios
from augment.services.texts import SLUG_LENGTH, check_slug, free_slug, one_line, read_code


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchmarkRequest:
    """A new version of a benchmark, the first one where its name is new."""

    slug: str = input_field(
        InputKind.TEXT,
        "Name",
        "Lower-case letters, digits and hyphens; one that is there gets its next version. Empty: "
        "made of the title.",
        default="",
        most=SLUG_LENGTH,
    )
    title: str = input_field(InputKind.TEXT, "Title", "In words, for a table's head.", most=120)
    scenarios: Sequence[str] = input_field(
        InputKind.NAMES,
        "Scenarios",
        "Slugs, patterns such as interplan-*, or set:paper, set:hard, paraphrases, all.",
    )
    practice: float = input_field(
        InputKind.NUMBER,
        "Practice",
        "The share of tasks whose references are handed out.",
        default=20.0,
        unit="%",
        least=0,
        most=90,
    )
    seed: int = input_field(
        InputKind.WHOLE,
        "Seed",
        "Which tasks are for practice.",
        default=1,
        least=0,
        most=2**31 - 1,
    )


def plan_benchmark(request: BenchmarkRequest) -> list[BenchmarkItem]:
    """Return the tasks of a benchmark that would be made now, in their order; none is stored.

    A follow-up that a set or a pattern brings along is left out.

    Raises:
        UnknownName: There is no such scenario or set.
        InvalidDocument: A number is out of its bounds.
        Conflict: There are none, or too many.
    """
    check_bounds(request)
    slugs = resolve_scenarios(request.scenarios)
    with_others = Scenario.objects.select_related("paraphrase_of", "follows")
    with_others = with_others.annotate(place=F("base_scene__content_hash"))
    by_slug = with_others.in_bulk(slugs, field_name="slug")
    rows = [by_slug[slug] for slug in slugs]
    rows = [row for row in rows if row.follows is None or row.slug in request.scenarios]
    if not 1 <= len(rows) <= MOST_TASKS:
        raise Conflict(f"A benchmark holds 1 to {MOST_TASKS} scenarios; these are {len(rows)}.")
    for row in rows:
        if row.follows is not None:
            raise Conflict(
                f"“{row.slug}” says how to change an answer to “{row.follows.slug}”: alone it is "
                "no task of a benchmark."
            )
    sizes = {
        row.slug: measure_task(scenes.LoadedScenario(row).intent, load_standard(row))
        for row in rows
    }
    strata = choose_strata(sizes)
    past = BenchmarkItem.objects.order_by("split")  # the test last
    earlier = {key: Split(split) for key, split in past.values_list("scenario__origin", "split")}
    splits = split_tasks(
        [_candidate(row, strata[row.slug], earlier) for row in rows],
        share=request.practice / 100.0,
        rng=np.random.default_rng(request.seed),
    )
    return [
        BenchmarkItem(
            scenario=row, position=place, split=splits[row.slug], stratum=strata[row.slug]
        )
        for place, row in enumerate(rows, start=1)
    ]


def load_standard(row: Scenario) -> Modification | None:
    """Return the reference that answers are measured by, None where the wish is open."""
    return None if row.is_open else scenes.LoadedScenario(row).reference


def public_origins() -> QuerySet[Scenario, Any]:
    """Return the origins of the catalogue's scenarios, whose references anybody can read."""
    return Scenario.objects.exclude(catalogue_set="").values("origin")


def list_remarks(row: Benchmark | None) -> tuple[str, ...]:
    """Return the remarks that belong to every score: how many test references can be known.

    Those of the catalogue and of what was made from it come with the project. A benchmark from
    before variants had an origin may hand out a variant of a test task with its reference.
    """
    tests = BenchmarkItem.objects.filter(benchmark=row, split=Split.TEST)
    public = public_origins()
    practice = BenchmarkItem.objects.filter(split=Split.PRACTICE).values("scenario__origin")
    remarks = {
        "Test references are public: {} of {} come with the project or vary such.": public,
        "Variants of {} of {} test tasks are handed out with their references.": practice,
    }
    counts = {
        text: tests.filter(scenario__origin__in=origins) for text, origins in remarks.items()
    }
    return tuple(text.format(len(rows), len(tests)) for text, rows in counts.items() if rows)


def _candidate(row: Any, stratum: Stratum, earlier: Mapping[UUID | None, Split]) -> SplitCandidate:
    """Return a scenario with all that would give its reference away if another one were known.

    Poses count by themselves, since not everybody says what a scenario was made from.
    """
    shared = [f"origin {row.origin}"]
    if row.intent is not None:
        shared.append(json.dumps(["intent", row.intent], sort_keys=True))
    reference = load_standard(row)
    if reference is not None and not reference.is_empty:
        place = row.place or row.base_scene_id
        shared.append(json.dumps([place, row.reference], sort_keys=True))
        for agent in reference.changed:
            pose = [round(value, 2) for value in (agent.x_m, agent.y_m, agent.heading_rad)]
            shared.append(json.dumps([place, pose]))
    return SplitCandidate(
        name=row.slug,
        stratum=stratum,
        type=row.type,
        shared=shared,
        has_reference=reference is not None,
        earlier=earlier.get(row.origin),
    )


@transaction.atomic
def make_benchmark(request: BenchmarkRequest, actor: User | None = None) -> Benchmark:
    """Keep a benchmark as its next version.

    Raises:
        UnknownName: There is no such scenario or set.
        InvalidDocument: Name, title or a number break their rules.
        Conflict: There are no scenarios, or too many, or somebody else makes the same version.
    """
    title = one_line("title", request.title, what="benchmark")
    same = Benchmark.objects.filter(title=title).values_list("slug", flat=True).first()
    slug = request.slug or same or free_slug(Benchmark.objects, title, otherwise="benchmark")
    check_slug(slug, what="benchmark")
    # Locked as whoever changes a scenario locks it: none changes until the checksum is kept.
    chosen = Scenario.objects.filter(slug__in=resolve_scenarios(request.scenarios))
    list(chosen.order_by("pk").select_for_update(of=("self",)).only("pk"))
    planned = plan_benchmark(request)
    prefetch_related_objects([task.scenario for task in planned], "base_scene")
    last = Benchmark.objects.filter(slug=slug).aggregate(last=Max("version"))["last"]
    row = Benchmark(
        slug=slug,
        title=title,
        version=(last or 0) + 1,
        made_on=timezone.now().date(),
        made_by=actor,
    )
    row.checksum = checksum(_make_set(row, planned))
    try:
        with transaction.atomic():
            row.save()
    except IntegrityError:
        raise Conflict(f"Somebody else has just made {row}; do it again for the next.") from None
    for item in planned:
        item.benchmark = row
    BenchmarkItem.objects.bulk_create(planned)
    after = {"benchmark": str(row), "tasks": len(planned), "checksum": row.checksum}
    log_change(row, "make", actor, after=after)
    return row


def benchmark_set(row: Benchmark) -> BenchmarkSet:
    """Return all of a benchmark, with every reference that is known: for the server alone.

    Raises:
        Conflict: Scenarios have changed since it was made.
    """
    items = row.items.select_related("scenario__base_scene", "scenario__paraphrase_of")
    benchmark = _make_set(row, items)
    if checksum(benchmark) != row.checksum:  # it may be of the time when no intent was handed out
        tasks = tuple(replace(task, intent=None) for task in benchmark.tasks)
        benchmark = replace(benchmark, tasks=tasks)
    if checksum(benchmark) != row.checksum:
        raise Conflict(
            f"Scenarios of the benchmark {row} have changed since it was made, so that its "
            "checksum no longer fits. Bring them back as they were, or make a new version."
        )
    return benchmark


def find_benchmark(name_or_code: str) -> Benchmark:
    """Return a benchmark by `hard` (its newest version that is not retired), `hard@2` or a code.

    Raises:
        UnknownName: There is none.
    """
    slug, _, version = name_or_code.partition("@")
    wanted: dict[str, Any] = {"slug": slug}
    if version.isdecimal():
        wanted["version"] = int(version)
    elif version:
        wanted = {"pk": None}
    else:
        wanted["retired_at"] = None
    if (code := read_code(name_or_code)).int:  # most names are not codes
        wanted = {"code": code}
    row = Benchmark.objects.filter(**wanted).order_by("-version").first()
    if row is None:
        raise UnknownName("benchmark", name_or_code, list(map(str, Benchmark.objects.all())))
    return row


def refuse_handed_out(scenario: str, splits: Collection[Split] = tuple(Split)) -> None:
    """Do nothing for a scenario, by its slug, that no benchmark hands out in one of these splits.

    Raises:
        Conflict: One that is not retired does.
    """
    items = BenchmarkItem.objects.filter(scenario__slug=scenario, split__in=splits)
    row = Benchmark.objects.filter(items__in=items, retired_at=None).first()
    if row is not None:
        raise Conflict(
            f"“{scenario}” is handed out in the benchmark {row} and stays as it is: "
            "add another scenario with what you want to change, or retire the benchmark first."
        )


def _make_set(row: Benchmark, items: Iterable[BenchmarkItem]) -> BenchmarkSet:
    tasks = [_make_task(item) for item in items]
    names = {task.name for task in tasks}
    return BenchmarkSet(
        name=row.slug,
        title=row.title,
        version=row.version,
        made_on=row.made_on,
        tasks=tuple(
            task if task.paraphrase_of in names else replace(task, paraphrase_of="")
            for task in tasks
        ),
    )


def _make_task(item: BenchmarkItem) -> BenchmarkTask:
    row, recording = item.scenario, item.scenario.base_scene.recording
    loaded = scenes.LoadedScenario(row)
    return BenchmarkTask(
        name=row.slug,
        type=row.type,
        instruction=row.instruction,
        language=row.language,
        split=Split(item.split),
        stratum=Stratum(item.stratum),
        scene=loaded.scene,
        recording=None if recording is None else recording_from_document(recording),
        keeps_traffic=row.keep_traffic,
        paraphrase_of="" if row.paraphrase_of is None else row.paraphrase_of.slug,
        reference=load_standard(row),
        intent=loaded.intent,
    )
