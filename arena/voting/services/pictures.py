"""Pictures and drives that a study can show, of contestants and of attention checks.

Frames are of studies that were opened before pairs had windows of their own.
"""

import hashlib
import json
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Any

from django.db.models import F, Min, Q, QuerySet

from arena.errors import NothingToPlan
from arena.models import Matchup, Study
from arena.pairing.plan import Check, PlanRules
from arena.pairing.rules import sample_place, scenario_at
from arena.voting.queries.showings import LEGEND
from augment.errors import Conflict
from augment.models import Augmentation, Contestant, GenerationJob, Scenario, Simulation
from augment.services.driving.simulations import Options
from augment.services.scenarios import camera_key, legends_of_changes

MOST_NAMED = 8
"""So many missing pictures are named, the others counted."""

Pair = tuple[Augmentation, Augmentation]
"""A right picture and a broken one of the same scenario."""

Cells = dict[tuple[str, str], Augmentation]
"""By place (a scenario, or one sample of it) and contestant, the augmentation that is shown."""


def find_showable(scenarios: Iterable[Scenario]) -> QuerySet[Augmentation]:
    """Return every augmentation of these scenarios that has a picture to judge."""
    return (
        Augmentation.objects.filter(scenario__in=scenarios, state__in=Augmentation.SHOWABLE)
        .exclude(image="")
        .select_related("scenario", "contestant")
        .only(
            *("image", "earlier_images", "sample", "options", "job", "scenario__slug"),
            *("contestant__slug", "contestant__kind"),
        )
    )


def with_picture(row: Augmentation, is_wanted: Callable[[str], bool]) -> Augmentation | None:
    """Return the row with that of its pictures, of today or of before, that is wanted.

    The row's `image` is changed in memory alone; None where no picture of it is wanted.
    """
    names = (row.image, *reversed(row.earlier_images))
    image = next((name for name in names if is_wanted(name)), None)
    if image is None:
        return None
    row.image = image
    return row


# --- Attention checks --------------------------------------------------------------------------


def latest_pairs(scenarios: Iterable[Scenario]) -> dict[str, Pair]:
    """Return by scenario the latest reference and the latest broken picture, in one window."""
    kinds = Contestant.Kind.REFERENCE, Contestant.Kind.CHECK
    rows = find_showable(scenarios).filter(
        contestant__kind__in=kinds, state=Augmentation.State.DONE
    )
    latest: dict[tuple[str, str], Augmentation] = {}
    for row in rows.order_by(F("finished_at").asc(nulls_first=True), "pk"):
        latest[row.scenario.slug, row.contestant.kind] = row
    pairs = {}
    for slug in sorted({slug for slug, _kind in latest}):
        good, broken = (latest.get((slug, kind)) for kind in kinds)
        if good is None or broken is None or good.image == broken.image:
            continue
        if camera_key(good.image) == camera_key(broken.image):
            pairs[slug] = (good, broken)
    return pairs


def check_pictures(
    scenarios: Iterable[Scenario], *, shows_all: bool
) -> tuple[tuple[Check, ...], Cells]:
    """Return the attention checks that there can be, at the places of a plan.

    Args:
        scenarios: Of the study.
        shows_all: Whether samples are judged apart: then a check goes with the first one.
    """
    checks: list[Check] = []
    cells: Cells = {}
    for slug, pair in latest_pairs(scenarios).items():
        place = sample_place(slug, 1) if shows_all else slug
        good, broken = (row.contestant.slug for row in pair)
        checks.append(Check(scenario=place, good=good, broken=broken))
        cells |= {(place, row.contestant.slug): row for row in pair}
    return tuple(checks), cells


def require_checks(checks: Collection[Check], *, wanted: int) -> None:
    """Raise NothingToPlan where there are fewer attention checks than each expert is to see."""
    if len(checks) >= wanted:
        return
    raise NothingToPlan(
        f"Attention checks wanted for each expert: {wanted}; scenarios with pictures for one: "
        f"{len(checks)}. Generate the contestant reference and press “Draw missing attention "
        "checks” on the page of a new study; or ask for fewer, or choose more scenarios."
    )


def without_lost_checks(rules: PlanRules, cells: Cells) -> PlanRules:
    """Return the rules with those attention checks that still have both of their pictures."""
    checks = tuple(
        check
        for check in rules.checks
        if {(check.scenario, check.good), (check.scenario, check.broken)} <= cells.keys()
    )
    return replace(rules, checks=checks)


# --- What a study shows ------------------------------------------------------------------------

Showing = dict[str, Any]
"""Columns of a matchup: names of its pictures, and their view."""


@dataclass(frozen=True, slots=True)
class ScenarioFrame:
    """Window and unmodified scene of all showings of a scenario.

    Attributes:
        view: Where metres lie.
        original_image: The scene before any change.
        legend: The legend's entries of the scene.
    """

    view: dict[str, Any]
    original_image: str
    legend: list[str]

    def showing(self, left: Augmentation, right: Augmentation) -> Showing:
        """Return the shown images and legend of two pictures of its window."""
        keys = legends_of_changes({row.pk: self.view for row in (left, right)})
        pair = sorted(set().union(*keys.values()))  # whichever side adds what
        return {
            "left_image": left.image,
            "right_image": right.image,
            "original_image": self.original_image,
            "view": {**self.view, LEGEND: {"scene": self.legend, "pair": pair}},
        }


Frames = dict[tuple[str, str], ScenarioFrame]
"""By scenario and window."""


def frames_shown(study: Study, scenarios: Iterable[str]) -> Frames:
    """Return those of the first showing of each scenario, of a study with one for all pairs."""
    if "windows" in study.rules:
        return {}
    shown = study.matchups.filter(scenario__slug__in=set(scenarios), view__has_key=LEGEND)
    first = shown.order_by().values("scenario").annotate(first=Min("pk")).values("first")
    rows = Matchup.objects.filter(pk__in=first).exclude(original_image="")
    return {
        (slug, camera_key(image)): ScenarioFrame(view, original, view[LEGEND]["scene"])
        for slug, image, view, original in rows.values_list(
            *("scenario__slug", "left_image", "view", "original_image")
        )
        if view
    }


class SampleRule(StrEnum):
    """Rule that selects the samples of a cell.

    ONE: one of each scenario, by the study's seed (`draw_sample`). ALL: every one, each against
    the same sample of the others.
    """

    ONE = "one"
    ALL = "all"


Latest = dict[tuple[str, str], dict[int, Augmentation]]
"""By scenario and contestant, the augmentation of each sample that finished last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyPictures:
    """The pictures of a study.

    Attributes:
        cells: By place and contestant; a place is a scenario, or one sample of it.
        jobs: Those that the pictures come from, by their age.
        options: By contestant, with which its pictures were made; only of those who ask models.
    """

    cells: Cells
    jobs: tuple[GenerationJob, ...]
    options: dict[str, dict[str, Any]]


def choose_pictures(
    contestants: list[Contestant],
    scenarios: list[Scenario],
    *,
    seed: int,
    rule: SampleRule = SampleRule.ONE,
    jobs: Sequence[GenerationJob] = (),
    challengers: Sequence[str] = (),
    jobs_of: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> StudyPictures:
    """Return the augmentation that finished last of each scenario, contestant and sample shown.

    Args:
        contestants: Who takes part.
        scenarios: On what.
        seed: Of the study.
        rule: Which samples are shown.
        jobs: Whose augmentations count; none for those of every job.
        challengers: Slugs of contestants whose augmentations count whatever their job.
        jobs_of: By slug of other contestants the codes of the only jobs that count.

    Raises:
        NothingToPlan: Pictures are missing; the text names them.
        Conflict: A contestant's pictures were made with different options.
    """
    rows = find_showable(scenarios).filter(contestant__in=contestants)
    if jobs:
        rows = rows.filter(Q(job__in=jobs) | Q(contestant__slug__in=challengers))
    for slug, codes in jobs_of.items():
        rows = rows.exclude(Q(contestant__slug=slug) & ~Q(job__code__in=codes))
    rows = rows.select_related("scenario", "contestant", "job")
    latest: Latest = defaultdict(dict)
    for row in rows.order_by(F("finished_at").asc(nulls_first=True), "pk"):
        latest[row.scenario.slug, row.contestant.slug][row.sample] = row
    _refuse_missing(latest, contestants, scenarios, rule)
    cells: Cells = {}
    for (scenario, contestant), samples in latest.items():
        if rule is SampleRule.ONE:
            drawn = sorted(samples)[draw_sample(seed, scenario, len(samples))]
            cells[scenario, contestant] = samples[drawn]
        else:
            for sample, row in samples.items():
                cells[sample_place(scenario, sample), contestant] = row
    _refuse_mixed(cells)
    used = {row.job_id: row.job for row in cells.values()}
    return StudyPictures(
        cells=cells,
        jobs=tuple(used[pk] for pk in sorted(used)),
        options={
            row.contestant.slug: row.options for row in cells.values() if row.options is not None
        },
    )


def _refuse_missing(
    latest: Latest, contestants: list[Contestant], scenarios: list[Scenario], rule: SampleRule
) -> None:
    """Raise NothingToPlan where a picture is missing, of a scenario or of one of its samples."""
    missing = []
    for scenario in sorted(row.slug for row in scenarios):
        shown = {who.slug: latest.get((scenario, who.slug), {}) for who in contestants}
        wanted = {sample for samples in shown.values() for sample in samples}
        for slug, samples in shown.items():
            if not samples:
                missing.append(f"{slug} on {scenario}")
            elif rule is SampleRule.ALL:
                lacking = sorted(wanted - samples.keys())
                missing += [f"{slug} on {scenario}, sample {sample}" for sample in lacking]
    if missing:
        more = len(missing) - MOST_NAMED
        names = ", ".join(missing[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
        raise NothingToPlan(f"There is no picture yet of {names}. Generate them first.")


def _refuse_mixed(cells: Cells) -> None:
    options: defaultdict[str, set[str]] = defaultdict(set)
    for (_, contestant), row in cells.items():
        options[contestant].add(json.dumps(row.options, sort_keys=True))
    jobs = ", ".join(sorted({row.job.name for row in cells.values()}))
    if mixed := sorted(slug for slug, ways in options.items() if len(ways) > 1):
        raise Conflict(
            f"The pictures of {', '.join(mixed)} were made with different options, in the jobs "
            f"{jobs}. Name the jobs whose augmentations the study is to show, or run them anew."
        )


def draw_sample(seed: int, scenario: str, samples: int) -> int:
    """Return which of so many samples of a scenario a study shows, from 0.

    The first eight bytes of the SHA-256 of "seed/scenario", modulo the number of samples: the same
    for every contestant that has as many.
    """
    digest = hashlib.sha256(f"{seed}/{scenario}".encode()).digest()
    return int.from_bytes(digest[:8], "big") % samples


Way = tuple[Any, ...]
"""The values of `Options`."""


def replay_settings(cells: Cells) -> dict[str, Any]:
    """Return how the drives were driven that a study plays, and of which scenarios, by slug.

    Those are the scenarios of which every picture that takes part was driven in one and the same
    way. A pair with a drive on one side alone would tell who was driven, and so who made it; so
    would a missing one where only attention checks lack it. Of several ways the one with most
    scenarios is taken, then the usual one.

    Raises:
        NothingToPlan: There is no such scenario; the text names what was not driven.
    """
    pictures: defaultdict[str, set[int]] = defaultdict(set)
    for (place, _), cell in cells.items():
        pictures[scenario_at(place)].add(cell.pk)
    driven: defaultdict[Way, set[int]] = defaultdict(set)
    drives = Simulation.objects.filter(
        augmentation__in={cell.pk for cell in cells.values()}, state=Simulation.State.DONE
    )
    names = [field.name for field in fields(Options)]
    for *way, picture in drives.values_list(*names, "augmentation"):
        driven[tuple(way)].add(picture)
    whole = {
        way: sorted(slug for slug, shown in pictures.items() if shown <= ways)
        for way, ways in driven.items()
    }
    usual: Way = astuple(Options())
    best = max(whole, key=lambda way: (len(whole[way]), way == usual, way), default=usual)
    if not whole.get(best):
        missing = sorted(names for names, cell in cells.items() if cell.pk not in driven[best])
        named = ", ".join(f"{who} on {where}" for where, who in missing[:MOST_NAMED])
        raise NothingToPlan(
            "No scenario can be played: each needs a drive of every picture that takes part. "
            f"Not driven: {named}; {len(missing)} in all. Simulate their jobs first."
        )
    return dict(zip(names, best, strict=True)) | {"scenarios": whole[best]}
