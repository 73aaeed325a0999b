"""Pictures that a study can show: of contestants, and of attention checks."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace

from django.db.models import F, QuerySet

from arena.errors import NothingToPlan
from arena.pairing.plan import Check, PlanRules
from arena.pairing.rules import sample_place
from augment.models import Augmentation, Contestant, Scenario
from augment.services.scenarios import camera_key

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
