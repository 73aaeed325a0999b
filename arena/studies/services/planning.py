"""Plans as rows: the rules that a study was opened with, its showings, and later plannings."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import eq
from typing import Self

import numpy as np
from django.contrib.auth.models import User
from django.db.models import Max

from arena.models import Matchup, Study
from arena.pairing.later import GridUnit, follow_on
from arena.pairing.plan import Check, Entry, PlannedMatchup, PlanRules
from arena.pairing.rules import Grid, sample_place, scenario_at
from arena.voting.services import pictures
from augment.models import Augmentation
from augment.services.scenarios import camera_key

_PLAIN = (
    *("votes_per_expert", "seed", "scenario_gap", "repeat_share", "repeat_distance"),
    *("overlap_share", "check_share"),
)
"""Rules that are kept as they are; studies opened before a rule existed go without it."""

# --- The plan of a study -----------------------------------------------------------------------


def frozen_rules(study: Study) -> PlanRules:
    """Return the rules as they were at opening; planning by them gives the study's matchups."""
    rules_stored = study.rules
    return PlanRules(
        entries=tuple(Entry(**entry) for entry in rules_stored["entries"]),
        experts=tuple(rules_stored["experts"]),
        checks=tuple(Check(**check) for check in rules_stored.get("checks", ())),
        alike=tuple(
            (place, first, other) for place, first, other in rules_stored.get("alike", ())
        ),
        challengers=tuple(rules_stored.get("challengers", ())),
        **{name: rules_stored[name] for name in _PLAIN if name in rules_stored},
    )


def frozen_pictures(study: Study) -> pictures.Cells:
    """Return the pictures that the study was opened with, whatever was drawn since."""
    rules = frozen_rules(study)
    wanted = {(entry.scenario, entry.contestant): entry for entry in rules.entries}
    scenarios = list(study.scenarios.only("slug"))
    shows_all = study.shows_all_samples
    _, cells = pictures.check_pictures(scenarios, shows_all=shows_all)
    rows = (
        pictures.find_showable(scenarios)
        .filter(contestant__in=study.contestants.all())
        .order_by("pk")
    )
    for row in rows:
        slug = row.scenario.slug
        cell = (sample_place(slug, row.sample) if shows_all else slug, row.contestant.slug)
        entry = wanted.get(cell)
        if entry is None or entry.sample != row.sample:
            continue
        if shown := pictures.with_picture(row, partial(eq, entry.picture)):
            cells[cell] = shown
    return cells


def list_shown(study: Study) -> list[Augmentation]:
    """Return the augmentations that the study shows, by scenario; no attention checks."""
    planned = study.matchups.exclude(kind=Matchup.Kind.CHECK).values_list("left", "right")
    keys = {key for pair in planned for key in pair}
    # Those in pairs that nobody is shown count too.
    rated = set(study.contestants.values_list("slug", flat=True))
    keys |= {row.pk for (_, slug), row in frozen_pictures(study).items() if slug in rated}
    rows = Augmentation.objects.filter(pk__in=keys)
    rows = rows.select_related("scenario__base_scene", "contestant")
    return list(rows.order_by("scenario__slug", "contestant__slug", "sample"))


def list_planned(study: Study) -> dict[str, list[PlannedMatchup]]:
    """Return every showing that is planned, by expert and position."""
    rows = study.matchups.order_by("expert__username", "position").values_list(
        *("expert__username", "position", "scenario__slug", "left__contestant__slug"),
        *("right__contestant__slug", "kind", "repeat_of__position"),
        "right__sample",
    )
    planned: dict[str, list[PlannedMatchup]] = defaultdict(list)
    for expert, position, slug, left, right, kind, repeats, sample in rows:
        scenario = slug
        if study.shows_all_samples:
            scenario = sample_place(slug, 1 if kind == Matchup.Kind.CHECK else sample)
        planned[expert].append(
            PlannedMatchup(
                expert=expert,
                position=position,
                scenario=scenario,
                left=left,
                right=right,
                kind=kind,
                repeats=repeats,
            )
        )
    return planned


def store(
    study: Study,
    planned: Sequence[PlannedMatchup],
    cells: pictures.Cells,
    experts: Iterable[User],
    *,
    batch: int = 0,
) -> None:
    """Store planned showings, each with tokens of its own; workers draw what nobody was shown yet.

    Args:
        study: Whose plan it is.
        planned: At positions that are free.
        cells: The pictures.
        experts: Everybody who is named.
        batch: 0 at the opening; later plannings count up.

    """
    by_name = {expert.username: expert for expert in experts}
    named = {scenario_at(pair.scenario) for pair in planned}
    earlier = _find_earlier(study, named) if batch else {}
    frames = pictures.frames_shown(study, named) if batch else {}
    sides = [
        (cells[pair.scenario, pair.left], cells[pair.scenario, pair.right]) for pair in planned
    ]
    rows = []
    for pair, (left, right) in zip(planned, sides, strict=True):
        window = (
            camera_key(left.image) if camera_key(left.image) == camera_key(right.image) else ""
        )
        frame = frames.get((scenario_at(pair.scenario), window))
        shown = earlier.get((left.pk, right.pk))
        if shown is None and frame is not None:
            shown = frame.showing(left, right)
        rows.append(
            Matchup(
                study=study,
                expert=by_name[pair.expert],
                position=pair.position,
                scenario_id=left.scenario_id,
                left=left,
                right=right,
                kind=pair.kind,
                batch=batch,
                **shown or {"view": {}},
            )
        )
    firsts = [row for row in rows if row.kind != Matchup.Kind.REPEAT]
    Matchup.objects.bulk_create(firsts, batch_size=500)
    pairs = zip(rows, planned, strict=True)
    again = [(row, plan) for row, plan in pairs if plan.repeats is not None]
    repeaters = {row.expert_id for row, _ in again}
    mains = study.matchups.filter(expert__in=repeaters, kind=Matchup.Kind.MAIN)
    keys = {(expert, at): pk for expert, at, pk in mains.values_list("expert", "position", "pk")}
    for row, plan in again:
        row.repeat_of_id = keys[row.expert_id, plan.repeats or 0]
    Matchup.objects.bulk_create([row for row, _ in again], batch_size=500)


def _find_earlier(
    study: Study, scenarios: Iterable[str]
) -> dict[tuple[int, int], pictures.Showing]:
    """Return what the study shows already, by left and right side, either way round."""
    columns = ("left", "right", "left_image", "right_image", "original_image", "view")
    drawn = study.matchups.filter(scenario__slug__in=scenarios, view__has_key="px_per_m")
    found: dict[tuple[int, int], pictures.Showing] = {}
    for left, right, *images, original, view in drawn.values_list(*columns):
        for sides, names in (((left, right), images), ((right, left), images[::-1])):
            shown = dict(zip(("left_image", "right_image"), names, strict=True))
            found[sides] = {**shown, "original_image": original, "view": view}
    return found


# --- Later plannings ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Planning:
    """A later planning of an open study, whose row is locked.

    A pure function of the study's seed and rules, of its number and of what was planned before.
    """

    study: Study
    number: int
    cells: pictures.Cells
    rules: PlanRules
    grid: Grid
    rng: np.random.Generator

    @classmethod
    def begin(cls, study: Study) -> Self:
        """Return the next planning of a study."""
        cells = frozen_pictures(study)
        rules = pictures.without_lost_checks(frozen_rules(study), cells)
        number = (study.matchups.aggregate(last=Max("batch"))["last"] or 0) + 1
        rng = np.random.default_rng([rules.seed, number])
        return cls(study=study, number=number, cells=cells, rules=rules, grid=rules.grid, rng=rng)

    def count_pairs(self, votes: int) -> int:
        """Return how many pairs somebody new is shown for a quota, repeats and checks included."""
        quota = min(votes, int(self.grid.showable.sum()))
        return quota + sum(self.rules.count_extras(quota))

    def follow(
        self, username: str, planned: Sequence[PlannedMatchup], units: Sequence[GridUnit]
    ) -> list[PlannedMatchup]:
        """Return an expert's next showings."""
        return follow_on(self.rules, self.grid, username, planned, units, self.rng)

    def store(self, planned: Sequence[PlannedMatchup], experts: Iterable[User]) -> None:
        """Store what was planned."""
        store(self.study, planned, self.cells, experts, batch=self.number)
