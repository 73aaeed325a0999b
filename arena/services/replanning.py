"""The adaptive part of a study, planned in batches while votes come in."""

from __future__ import annotations

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
from arena.pairing.order import FloatArray
from arena.queries.voting.path import upcoming
from arena.services.attention_checks import without_lost_checks
from arena.services.plans import (
    next_batch,
    pictures_of,
    planned_so_far,
    rules_of,
    store,
    votes_left,
)
from arena.services.vote_writes import mark_served
from augment.services.events import log_event

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
