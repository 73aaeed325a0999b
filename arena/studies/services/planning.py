"""Plans as rows: the rules that a study was opened with, and its planned showings."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from functools import partial
from operator import eq
from typing import Any

import numpy as np
from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Count, Max

from arena.models import Matchup, Study, Vote
from arena.pairing.later import (
    contestants_of,
    draw_units,
    follow_on,
    judges,
    ratings_so_far,
    units_of,
)
from arena.pairing.plan import Check, Entry, PlannedMatchup, PlanRules
from arena.pairing.rules import FloatArray, place_of, scenario_of
from arena.queries.voting.path import upcoming
from arena.queries.voting.showings import LEGEND
from arena.services.frames import Cells, ScenarioFrame, find_frames, frames_shown, sides_of
from arena.services.vote_writes import mark_served
from arena.studies.services.pictures import (
    check_pictures,
    find_showable,
    placed_checks,
    windows_of,
    with_picture,
    without_lost_checks,
)
from augment.models import Augmentation, Scenario
from augment.services.events import log_event
from augment.services.scenarios.pictures import (
    Description,
    descriptions,
    legend_of_scene,
    legends_of_changes,
)

SoFar = dict[str, list[PlannedMatchup]]
"""Every expert's showings as they are stored, by position."""


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


def pictures_of(study: Study) -> Cells:
    """The pictures that the study was opened with; later ones of the same contestants stay out."""
    rules = rules_of(study)
    wanted = {(entry.scenario, entry.contestant): entry for entry in rules.entries}
    scenarios = list(study.scenarios.only("slug"))
    found = check_pictures(scenarios, windows_of(rules.entries))
    _, cells = placed_checks(*found, shows_all=study.shows_all_samples)
    rows = find_showable(scenarios).filter(contestant__in=study.contestants.all()).order_by("pk")
    for row in rows:
        cell = (_place(study, row), row.contestant.slug)
        entry = wanted.get(cell)
        if entry is None or entry.sample != row.sample:
            continue
        if shown := with_picture(row, partial(eq, entry.picture)):
            cells[cell] = shown
    return cells


def shown_augmentations(study: Study) -> list[Augmentation]:
    """What the study shows of its contestants, by scenario; no attention checks."""
    planned = study.matchups.exclude(kind=Matchup.Kind.CHECK).values_list("left", "right")
    keys = {key for pair in planned for key in pair}
    # Whoever is in pairs that nobody is shown; a picture drawn anew since is no longer told.
    rated = set(study.contestants.values_list("slug", flat=True))
    keys |= {row.pk for (_, slug), row in pictures_of(study).items() if slug in rated}
    rows = Augmentation.objects.filter(pk__in=keys)
    rows = rows.select_related("scenario__base_scene", "contestant")
    return list(rows.order_by("scenario__slug", "contestant__slug", "sample"))


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
    known = frames_shown(study, {scenario_of(one.scenario) for one in planned}) if batch else {}
    places = _places(planned, cells, reads_scenes=study.allow_text or not known)
    frames = find_frames(planned, cells, places, known)
    texts = _descriptions(study, planned, cells, places)
    views = _pair_views(planned, cells, places, frames)
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
            view=view,
            descriptions=None if texts is None else [texts[left.pk], texts[right.pk]],
            kind=one.kind,
            batch=batch,
            draw_probability=one.draw_probability,
        )
        for one, view in zip(planned, views, strict=True)
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
        if study.shows_all_samples:
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
    *("overlap_share", "check_share", "adaptive_share", "uniform_share", "batch_size"),
)
"""Rules that are kept as they are; studies opened before a rule existed go without it."""


def _place(study: Study, row: Augmentation) -> str:
    slug = row.scenario.slug
    return place_of(slug, row.sample) if study.shows_all_samples else slug


def _places(
    planned: Sequence[PlannedMatchup], cells: Cells, *, reads_scenes: bool
) -> dict[str, Scenario]:
    """The scenarios, with what their views are worked out from where all of these are needed."""
    named = {one.scenario for one in planned}
    keys = {cell.scenario_id for (place, _), cell in cells.items() if place in named}
    rows = Scenario.objects.filter(pk__in=keys)
    if reads_scenes:
        rows = rows.select_related("base_scene").defer("base_scene__recording")
    return {row.slug: row for row in rows}


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


def _pair_views(
    planned: Sequence[PlannedMatchup],
    cells: Cells,
    places: dict[str, Scenario],
    frames: dict[str, ScenarioFrame],
) -> list[dict[str, Any]]:
    """The view of each showing, with what its legend names: the same whichever side adds what."""
    scenes: dict[str, list[str]] = {}
    for name, frame in frames.items():
        slug = scenario_of(name)
        kept = frame.view.get(LEGEND)
        if kept is not None:
            scenes[slug] = kept["scene"]
        elif slug not in scenes:
            scenes[slug] = legend_of_scene(places[slug], frame.view)
    sides = [(one.scenario, sides_of(one, cells)) for one in planned]
    adds = legends_of_changes(
        {cell.pk: frames[name].view for name, pair in sides for cell in pair}
    )
    return [
        frames[name].view
        | {
            LEGEND: {
                "scene": scenes[scenario_of(name)],
                "pair": sorted(adds[left.pk] | adds[right.pk]),
            }
        }
        for name, (left, right) in sides
    ]


def _mains(study: Study, experts: list[int]) -> dict[tuple[int, int], int]:
    rows = study.matchups.filter(expert__in=experts, kind=Matchup.Kind.MAIN)
    return {
        (expert, position): pk
        for expert, position, pk in rows.values_list("expert", "position", "pk")
    }


MOST_AHEAD = 12
"""So many matchups a browser may ask for; with as many waiting no new batch is needed."""


def next_pairs(*, study: Study, expert: User, n: int) -> list[Matchup]:
    """The expert's next matchups, marked as served; the adaptive part is planned as it is needed.

    A study that is not open has none.
    """
    if study.state != Study.State.OPEN:
        return []
    coming = upcoming(study=study, expert=expert, n=n)
    if len(coming) < n and plan_batch(study=study, expert=expert):
        coming = upcoming(study=study, expert=expert, n=n)
    if any(matchup.served_at is None for matchup in coming):
        with transaction.atomic():
            mark_served(matchups=coming)
    return coming


def plan_batch(*, study: Study, expert: User) -> int:
    """Plan an expert's next batch of the adaptive part, from the votes that there are now.

    A pure function of the study's seed and rules, of what was planned before and of the votes up
    to the row that the log names; stored before its first showing.

    Returns:
        How many matchups were planned; 0 where nothing is left to plan.
    """
    if not votes_left(study, expert):
        return 0
    with transaction.atomic():
        held = Study.objects.select_for_update().get(pk=study.pk)
        left = votes_left(held, expert)
        if not left or held.state != Study.State.OPEN or _waiting(held, expert) >= MOST_AHEAD:
            return 0
        cells, known, number = pictures_of(held), planned_so_far(held), next_batch(held)
        rules = without_lost_checks(rules_of(held), cells)
        grid = rules.grid
        mine = known[expert.username]
        scores, last_vote, votes = _scores(held, contestants_of(grid))
        ratings, covariance = ratings_so_far(scores)
        rng = np.random.default_rng([rules.seed, number])
        units = draw_units(
            grid,
            {(unit.pair, unit.scenario) for unit in units_of(grid, mine)},
            judges(grid, known),
            ratings,
            covariance,
            rules.uniform_share,
            min(left, rules.batch_size),
            rng,
        )
        planned, gap = follow_on(rules, grid, expert.username, mine, units, rng)
        store(held, planned, cells, [expert], batch=number)
        # Where every unit is known to the expert, the rest of the quota can't be filled.
        rest = left - len(units) if units else 0
        held.votes_to_plan = {**held.votes_to_plan, expert.username: rest}
        held.save(update_fields=["votes_to_plan"])
        _log(held, expert, number, len(planned), votes, last_vote, gap)
        return len(planned)


# --- Private -----------------------------------------------------------------------------------


def _log(
    study: Study, expert: User, batch: int, matchups: int, votes: int, last_vote: int, gap: int
) -> None:
    log_event(
        actor=None,
        verb="plan batch",
        object_kind="study",
        object_code=study.code,
        after={
            "batch": batch,
            "expert": str(expert.person.code),
            "matchups": matchups,
            "votes": votes,
            "last_vote": last_vote,
            "scenario_gap": gap,
        },
    )


def _waiting(study: Study, expert: User) -> int:
    return study.matchups.filter(expert=expert, votes=None).count()


def _scores(study: Study, names: list[str]) -> tuple[FloatArray, int, int]:
    """What each contestant scored against each other; the newest vote's row; how many votes."""
    places = {name: index for index, name in enumerate(names)}
    scores = np.zeros((len(names), len(names)))
    current = Vote.objects.filter(
        matchup__study=study, matchup__kind=Matchup.Kind.MAIN, superseded_by=None
    ).exclude(outcome=Vote.Outcome.SKIP)
    counted = (
        current.order_by()
        .values("shown_left__contestant__slug", "shown_right__contestant__slug", "outcome")
        .annotate(n=Count("pk"))
        .values_list(
            "shown_left__contestant__slug", "shown_right__contestant__slug", "outcome", "n"
        )
    )
    won = {Vote.Outcome.LEFT: 1.0, Vote.Outcome.EQUAL: 0.5, Vote.Outcome.RIGHT: 0.0}
    for left, right, outcome, n in counted:
        share = won[Vote.Outcome(outcome)]
        scores[places[left], places[right]] += n * share
        scores[places[right], places[left]] += n * (1.0 - share)
    last = Vote.objects.filter(matchup__study=study).aggregate(last=Max("pk"))["last"]
    return scores, last or 0, round(float(scores.sum()))
