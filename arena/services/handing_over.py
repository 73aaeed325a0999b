"""Handing over what an expert has not judged to others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from django.contrib.auth.models import User
from django.db import transaction

from arena.errors import NothingToPlan, StudyNotOpen
from arena.models import Matchup, Study
from arena.pairing.later import deal, follow_on, units_of
from arena.pairing.rules import PlannedMatchup, place_of
from arena.queries.people import experts as expert_accounts
from arena.services.attention_checks import without_lost_checks
from arena.services.plans import (
    next_batch,
    pictures_of,
    planned_so_far,
    rules_of,
    store,
    votes_left,
)
from augment.errors import Conflict, UnknownName
from augment.services.events import log_event


@transaction.atomic
def hand_over(
    *, study: Study, username: str, to: Sequence[str], actor: User | None = None
) -> dict[str, int]:
    """Let others judge what an expert has not judged, re-planned in one go.

    Every pair keeps its votes. The rows of the undecided matchups give way to new ones with fresh
    tokens, behind what the takers have; their sides are balanced anew. The expert's votes stay, as
    do pairs that the expert has reported without judging them: the report is about them. So do
    pairs whose hidden repeat has a vote already, which only votes out of order can lead to.

    Args:
        study: An open one.
        username: Whose matchups are handed over.
        to: Usernames of experts; who is new to the study joins it.
        actor: Who hands over, for the log.

    Returns:
        How many votes each taker is to give, by username.

    Raises:
        StudyNotOpen: The study takes no votes.
        UnknownName: Somebody is no expert, or does not vote in the study.
        Conflict: The takers are simulated where the study does not allow it, or include the giver.
        NothingToPlan: Nothing is left to hand over, or nobody can take a pair.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state != Study.State.OPEN:
        raise _not_open(study)
    giver, takers = _giver(study, username), _takers(study, username, to)
    cells, known, number = pictures_of(study), planned_so_far(study), next_batch(study)
    rules = without_lost_checks(rules_of(study), cells)
    grid = rules.grid
    rng = np.random.default_rng([rules.seed, number])
    open_rows = undecided_rows(study, giver)
    names = [taker.username for taker in takers]
    units = units_of(grid, [_as_planned(row) for row in open_rows])
    later = _shares(votes_left(study, giver), names)
    if not units and not any(later.values()):
        raise NothingToPlan(f"{username} has nothing left to hand over.")
    dealt = deal(grid, known, names, units, rng)
    planned = [
        one
        for name in names
        for one in follow_on(rules, grid, name, known[name], dealt[name], rng)[0]
    ]
    Matchup.objects.filter(pk__in=[row.pk for row in open_rows]).delete()
    store(study, planned, cells, takers, batch=number)
    study.experts.add(*takers)
    _move_votes_to_plan(study, username, later)
    taken = {name: len(dealt[name]) + later[name] for name in names}
    log_event(
        actor=actor,
        verb="hand over",
        object_kind="study",
        object_code=study.code,
        before={"expert": username, "matchups": [_line(row) for row in open_rows]},
        after={"batch": number, "votes": taken},
    )
    return taken


# --- Who ---------------------------------------------------------------------------------------


def _not_open(study: Study) -> StudyNotOpen:
    return StudyNotOpen(f"The study '{study.name}' is {study.state}: nothing is handed over.")


def _giver(study: Study, username: str) -> User:
    found = study.experts.filter(username=username).first()
    if found is None:
        known = sorted(study.experts.values_list("username", flat=True))
        raise UnknownName("expert of this study", username, known)
    return found


def _takers(study: Study, username: str, to: Sequence[str]) -> list[User]:
    known = {user.username: user for user in expert_accounts()}
    if not to:
        raise Conflict("Name at least one expert who takes over.")
    if username in to:
        raise Conflict(f"{username} can't take over their own pairs.")
    for name in to:
        if name not in known:
            raise UnknownName("expert", name, sorted(known))
    takers = [known[name] for name in sorted(set(to))]
    simulated = [user.username for user in takers if user.person.is_simulated]
    if simulated and not study.allow_simulated:
        raise Conflict(f"Simulated: {', '.join(simulated)}. This study does not allow them.")
    return takers


# --- Handing over ------------------------------------------------------------------------------


def undecided_rows(study: Study, giver: User) -> list[Matchup]:
    """What an expert has not judged and nobody has reported, held until it is re-planned.

    A vote holds its matchup's row until it is stored, and a report until then as well: having
    waited for them, look again.
    """
    untouched = (
        study.matchups.filter(expert=giver, votes=None, reports=None)
        .exclude(repeated_by__reports__isnull=False)
        .exclude(repeated_by__votes__isnull=False)
    )
    rows = list(
        untouched.select_for_update(of=("self",))
        .select_related("study", "scenario", "left__contestant", "right__contestant")
        .order_by("position")
    )
    still = set(untouched.values_list("pk", flat=True))
    return [row for row in rows if row.pk in still]


def _as_planned(row: Matchup) -> PlannedMatchup:
    scenario = row.scenario.slug
    if row.study.shows_all_samples:
        scenario = place_of(scenario, 1 if row.kind == Matchup.Kind.CHECK else row.right.sample)
    return PlannedMatchup(
        expert="",
        position=row.position,
        scenario=scenario,
        left=row.left.contestant.slug,
        right=row.right.contestant.slug,
        draw_probability=row.draw_probability,
        kind=row.kind,
    )


def _line(row: Matchup) -> list[str | int]:
    """One withdrawn matchup in the log."""
    shown = row.left.contestant.slug, row.right.contestant.slug
    return [row.position, row.kind, row.scenario.slug, *shown]


def _shares(votes: int, names: Sequence[str]) -> dict[str, int]:
    """Votes that are still to be planned, shared out equally."""
    return {
        name: votes // len(names) + (index < votes % len(names))
        for index, name in enumerate(names)
    }


def _move_votes_to_plan(study: Study, giver: str, later: dict[str, int]) -> None:
    if not study.votes_to_plan:
        return
    waiting = {**study.votes_to_plan, giver: 0}
    for name, votes in later.items():
        waiting[name] = waiting.get(name, 0) + votes
    study.votes_to_plan = waiting
    study.save(update_fields=["votes_to_plan"])
