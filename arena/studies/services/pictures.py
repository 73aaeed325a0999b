"""Which pictures can be shown at all, what is missing, and which windows they show."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from functools import partial

from django.db.models import F, QuerySet

from arena.errors import NothingToPlan
from arena.pairing.plan import Check, Entry, PlanRules
from arena.pairing.rules import place_of, scenario_of
from arena.services.frames import MOST_NAMED, Cells
from augment.models import Augmentation, Contestant, Scenario
from augment.services.scenarios.pictures import window_of


def find_showable(scenarios: list[Scenario]) -> QuerySet[Augmentation]:
    """Every augmentation of these scenarios that has a picture to judge."""
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


def refuse_missing(
    contestants: list[Contestant], scenarios: list[Scenario], cells: Collection[tuple[str, str]]
) -> None:
    """Do nothing where everybody has a picture of every scenario.

    Raises:
        NothingToPlan: Pictures are missing; the text names them.
    """
    missing = [
        f"{contestant.slug} on {scenario.slug}"
        for contestant in contestants
        for scenario in scenarios
        if (scenario.slug, contestant.slug) not in cells
    ]
    if missing:
        raise NothingToPlan(_no_pictures(missing))


def windows_of(entries: Iterable[Entry]) -> dict[str, str]:
    """By scenario, the window that its pictures in a study show: of the first sample, if apart."""
    found: dict[str, str] = {}
    for entry in sorted(entries, key=lambda one: one.scenario):
        found.setdefault(scenario_of(entry.scenario), window_of(entry.picture))
    return found


# --- Private -----------------------------------------------------------------------------------


def _no_pictures(missing: list[str]) -> str:
    if len(missing) <= MOST_NAMED:
        return f"There is no picture yet of {', '.join(missing)}. Generate them first."
    return (
        f"There is no picture yet of {', '.join(missing[:MOST_NAMED])} and "
        f"{len(missing) - MOST_NAMED} more. Generate them first."
    )


Kind = Contestant.Kind


def check_pictures(
    scenarios: list[Scenario], windows: Mapping[str, str]
) -> tuple[tuple[Check, ...], Cells]:
    """What attention checks there can be: the latest reference against the latest broken one.

    Args:
        scenarios: Of the study.
        windows: By scenario; pictures of another window stay out.
    """
    found = find_showable(scenarios).filter(
        contestant__kind__in=[Kind.REFERENCE, Kind.CHECK], state=Augmentation.State.DONE
    )
    latest: dict[tuple[str, str], Augmentation] = {}
    for row in found.order_by(F("finished_at").asc(nulls_first=True), "pk"):
        window = windows.get(row.scenario.slug)
        if shown := with_picture(row, partial(_is_in, window)):
            latest[row.scenario.slug, row.contestant.kind] = shown
    checks: list[Check] = []
    cells: Cells = {}
    for scenario in sorted({slug for slug, _ in latest}):
        good, broken = latest.get((scenario, Kind.REFERENCE)), latest.get((scenario, Kind.CHECK))
        if good is None or broken is None or good.image == broken.image:
            continue
        names = good.contestant.slug, broken.contestant.slug
        checks.append(Check(scenario=scenario, good=names[0], broken=names[1]))
        cells |= {(scenario, names[0]): good, (scenario, names[1]): broken}
    return tuple(checks), cells


def enough_checks(
    scenarios: list[Scenario], *, windows: Mapping[str, str], wanted: int
) -> tuple[tuple[Check, ...], Cells]:
    """What `check_pictures` gives, if that is as much as a study asks for.

    Args:
        scenarios: Of the study; an expert sees at most one check of each.
        windows: By scenario, as `check_pictures` takes them.
        wanted: How many each expert is to see.

    Raises:
        NothingToPlan: There are too few; the text says what to do.
    """
    checks, cells = check_pictures(scenarios, windows) if wanted else ((), {})
    if len(checks) >= wanted:
        return checks, cells
    ready = {check.scenario for check in checks}
    with_reference = Scenario.objects.filter(
        pk__in=[row.pk for row in scenarios], reference__isnull=False
    )
    missing = [row.slug for row in with_reference if row.slug not in ready]
    if len(ready) + len(missing) >= wanted:
        raise NothingToPlan(
            f"Attention checks wanted for each expert: {wanted}; scenarios with pictures for "
            f"one: {len(checks)}. Generate the contestant reference and press “Draw missing "
            "attention checks” on the page of a new study, then open it; or ask for 0 %."
        )
    raise NothingToPlan(
        f"Attention checks wanted for each expert: {wanted}; each needs a scenario of its "
        f"own with a reference, and the study has {len(ready) + len(missing)}. Ask for "
        "fewer, or choose more scenarios."
    )


def placed_checks(
    checks: tuple[Check, ...], cells: Cells, *, shows_all: bool
) -> tuple[tuple[Check, ...], Cells]:
    """Attention checks at the places of a plan: where samples are apart, with the first one."""
    if not shows_all:
        return checks, cells
    return (
        tuple(replace(check, scenario=place_of(check.scenario, 1)) for check in checks),
        {(place_of(scenario, 1), who): row for (scenario, who), row in cells.items()},
    )


def without_lost_checks(rules: PlanRules, cells: Cells) -> PlanRules:
    """The rules with those attention checks that still have both of their pictures."""
    kept = tuple(
        check
        for check in rules.checks
        if {(check.scenario, check.good), (check.scenario, check.broken)} <= cells.keys()
    )
    return replace(rules, checks=kept)


def _is_in(window: str | None, image: str) -> bool:
    return window_of(image) == window
