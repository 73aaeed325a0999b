"""Plans as rows: which pictures take part, and how planned showings are stored."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from django.contrib.auth.models import User
from django.db.models import F, Max, QuerySet

from arena.errors import NothingToPlan
from arena.models import Matchup, Study
from arena.pairing.plan import Check, Entry, PlannedMatchup, PlanRules
from arena.pairing.rules import place_of, scenario_of
from arena.services.frames import MOST_NAMED, Cells, find_frames, sides_of
from augment.models import Augmentation, Contestant, Scenario
from augment.sentences import Sentence, sentence
from augment.services.scenarios.descriptions import Description, descriptions
from augment.services.scenarios.pictures import window_of

SoFar = dict[str, list[PlannedMatchup]]
"""Every expert's showings as they are stored, by position."""

Kind = Contestant.Kind


def rules_of(study: Study) -> PlanRules:
    """The rules as they were at opening; planning them again gives the study's matchups."""
    kept = study.rules
    return PlanRules(
        entries=tuple(Entry(**entry) for entry in kept["entries"]),
        experts=tuple(kept["experts"]),
        appearances=tuple((name, votes) for name, votes in kept.get("appearances", ())),
        pair_votes=tuple((one, other, n) for one, other, n in kept.get("pair_votes", ())),
        checks=tuple(Check(**check) for check in kept.get("checks", ())),
        alike=tuple((place, one, other) for place, one, other in kept.get("alike", ())),
        **{name: kept[name] for name in _PLAIN if name in kept},
    )


def refuse_missing(
    contestants: list[Contestant],
    scenarios: list[Scenario],
    cells: Collection[tuple[str, str]],
) -> None:
    """Do nothing where everybody has a picture of every scenario.

    Raises:
        NothingToPlan: Pictures are missing; the text names them.
    """
    missing = [
        sentence(
            "%(contestant)s on %(scenario)s", contestant=contestant.slug, scenario=scenario.slug
        )
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
        if windows.get(row.scenario.slug) == window_of(row.image):
            latest[row.scenario.slug, row.contestant.kind] = row
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
            sentence(
                "Attention checks wanted for each expert: %(wanted)s; scenarios with pictures for "
                "one: %(found)s. Generate the contestant reference and run “manage.py draw_checks "
                "all”, which draws the broken pictures, then open the study; or ask for 0 %%.",
                wanted=wanted,
                found=len(checks),
            )
        )
    raise NothingToPlan(
        sentence(
            "Attention checks wanted for each expert: %(wanted)s; each needs a scenario of its "
            "own with a reference, and the study has %(most)s. Ask for fewer, or choose more "
            "scenarios.",
            wanted=wanted,
            most=len(ready) + len(missing),
        )
    )


def pictures_of(study: Study) -> Cells:
    """The pictures that the study was opened with; later ones of the same contestants stay out."""
    rules = rules_of(study)
    wanted = {(entry.scenario, entry.contestant): entry for entry in rules.entries}
    scenarios = list(study.scenarios.only("slug"))
    found = check_pictures(scenarios, windows_of(rules.entries))
    _, cells = placed_checks(*found, shows_all=shows_all_samples(study))
    rows = find_showable(scenarios).filter(contestant__in=study.contestants.all()).order_by("pk")
    for row in rows:
        cell = (_place(study, row), row.contestant.slug)
        entry = wanted.get(cell)
        if entry is not None and (entry.picture, entry.sample) == (row.image, row.sample):
            cells[cell] = row
    return cells


def without_lost_checks(rules: PlanRules, cells: Cells) -> PlanRules:
    """The rules with those attention checks that still have both of their pictures."""
    kept = tuple(
        check
        for check in rules.checks
        if {(check.scenario, check.good), (check.scenario, check.broken)} <= cells.keys()
    )
    return replace(rules, checks=kept)


def shows_all_samples(study: Study) -> bool:
    """Whether each sample of a scenario is judged on its own."""
    return bool(study.rules.get("samples") == "all")


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


def store(
    study: Study,
    planned: Sequence[PlannedMatchup],
    cells: Cells,
    experts: Iterable[User],
    *,
    batch: int = 0,
) -> list[Matchup]:
    """Keep planned showings, each with tokens of its own.

    Args:
        study: Whose plan it is.
        planned: At positions that are free.
        cells: The pictures.
        experts: Everybody who is named.
        batch: 0 at the opening; later plannings count up.

    Raises:
        NothingToPlan: The pictures of a scenario are drawn in several windows.
    """
    by_name = {expert.username: expert for expert in experts}
    places = _places(planned, cells)
    frames = find_frames(planned, cells, places)
    texts = _descriptions(study, planned, cells, places)
    rows = [
        Matchup(
            study=study,
            expert=by_name[one.expert],
            position=one.position,
            scenario=places[scenario_of(one.scenario)],
            left=left,
            right=right,
            left_image=left.image,
            right_image=right.image,
            original_image=frames[one.scenario].original_image,
            view=frames[one.scenario].view,
            descriptions=None if texts is None else [texts[left.pk], texts[right.pk]],
            kind=one.kind,
            batch=batch,
            draw_probability=one.draw_probability,
        )
        for one in planned
        for left, right in [sides_of(one, cells)]
    ]
    Matchup.objects.bulk_create([row for row in rows if row.kind != _REPEAT], batch_size=500)
    again = [(row, one) for row, one in zip(rows, planned, strict=True) if one.repeats is not None]
    if again:
        shown = _mains(study, [row.expert_id for row, _ in again])
        for row, one in again:
            row.repeat_of_id = shown[row.expert_id, one.repeats or 0]
        Matchup.objects.bulk_create([row for row, _ in again], batch_size=500)
    return rows


def votes_left(study: Study, expert: User) -> int:
    """Votes of the expert that the adaptive part still has to plan."""
    return int(study.votes_to_plan.get(expert.username, 0))


def next_batch(study: Study) -> int:
    """The number of the next planning; hold the study's row."""
    last = study.matchups.aggregate(last=Max("batch"))["last"]
    return (last or 0) + 1


def planned_so_far(study: Study) -> SoFar:
    """Every showing that is planned."""
    rows = study.matchups.order_by("expert__username", "position").values_list(
        *("expert__username", "position", "scenario__slug", "left__contestant__slug"),
        *("right__contestant__slug", "draw_probability", "kind", "repeat_of__position"),
        "right__sample",
    )
    found: SoFar = defaultdict(list)
    for expert, position, slug, left, right, chance, kind, repeats, sample in rows:
        scenario = slug
        if shows_all_samples(study):
            scenario = place_of(slug, 1 if kind == Matchup.Kind.CHECK else sample)
        found[expert].append(
            PlannedMatchup(
                expert=expert,
                position=position,
                scenario=scenario,
                left=left,
                right=right,
                draw_probability=chance,
                kind=kind,
                repeats=repeats,
            )
        )
    return found


# --- Private -----------------------------------------------------------------------------------

_REPEAT = Matchup.Kind.REPEAT
_PLAIN = (
    *("votes_per_expert", "seed", "scenario_gap", "repeat_share", "repeat_distance"),
    *("check_share", "adaptive_share", "uniform_share", "batch_size"),
)
"""Rules that are kept as they are; studies opened before a rule existed go without it."""


def find_showable(scenarios: list[Scenario]) -> QuerySet[Augmentation]:
    """Every augmentation of these scenarios that has a picture to judge."""
    return (
        Augmentation.objects.filter(scenario__in=scenarios, state__in=Augmentation.SHOWABLE)
        .exclude(image="")
        .select_related("scenario", "contestant")
        .only(
            *("image", "sample", "options", "job", "scenario__slug"),
            *("contestant__slug", "contestant__kind"),
        )
    )


def _place(study: Study, row: Augmentation) -> str:
    slug = row.scenario.slug
    return place_of(slug, row.sample) if shows_all_samples(study) else slug


def _places(planned: Sequence[PlannedMatchup], cells: Cells) -> dict[str, Scenario]:
    """The scenarios with what their views are worked out from."""
    named = {one.scenario for one in planned}
    keys = {cell.scenario_id for (place, _), cell in cells.items() if place in named}
    rows = Scenario.objects.filter(pk__in=keys).select_related("base_scene")
    return {row.slug: row for row in rows.defer("base_scene__recording")}


def _descriptions(
    study: Study, planned: Sequence[PlannedMatchup], cells: Cells, places: dict[str, Scenario]
) -> dict[int, Description] | None:
    """What every picture shows, by the key of its augmentation; None where nobody may read it."""
    if not study.allow_text:
        return None
    shown = {cell.pk for one in planned for cell in sides_of(one, cells)}
    return descriptions(
        augmentations=shown, scenarios={place.pk: place for place in places.values()}
    )


def _mains(study: Study, experts: list[int]) -> dict[tuple[int, int], int]:
    rows = study.matchups.filter(expert__in=experts, kind=Matchup.Kind.MAIN)
    return {
        (expert, position): pk
        for expert, position, pk in rows.values_list("expert", "position", "pk")
    }


def _no_pictures(missing: list[Sentence]) -> Sentence:
    if len(missing) <= MOST_NAMED:
        return sentence(
            "There is no picture yet of %(cells)s. Generate them first.", cells=tuple(missing)
        )
    return sentence(
        "There is no picture yet of %(cells)s and %(number)s more. Generate them first.",
        cells=tuple(missing[:MOST_NAMED]),
        number=len(missing) - MOST_NAMED,
    )
