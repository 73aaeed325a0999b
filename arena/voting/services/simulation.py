"""Votes that the machine makes for a demonstration; they are marked as simulated everywhere.

The simulated judge is honest and noisy: it prefers the change that lies nearer the scenario's
reference, misjudges distances a little, calls close ones equal, and now and then presses just any
key, as people do. Every question of a study is answered so, each with noise of its own.
"""

from uuid import uuid5

import numpy as np
from django.db import transaction

from arena.models import Study, Vote
from arena.voting.services.casting import Decision, cast_vote
from augment.errors import Conflict
from augment.services import log_change
from augment.services.judging.displacement import of_rows

NOISE_M = 1.5
TIE_M = 1.0
SLIP = 0.08
"""The share of votes that are any key; it also keeps who always loses within reach."""


def simulate_votes(*, study: Study, seed: int) -> int:
    """Vote on every undecided matchup of the study's simulated experts.

    Args:
        study: Open, and one that allows simulated votes.
        seed: Of the judges' noise; the same study and seed give the same votes.

    Returns:
        How many votes were cast.

    Raises:
        Conflict: The study does not allow simulated votes.
        StudyNotOpen: It takes no votes.
    """
    if not study.allow_simulated:
        raise Conflict(f"The study {study.name!r} does not allow simulated votes.")
    undecided = study.matchups.filter(votes=None, expert__person__is_simulated=True)
    waiting = undecided.select_related("expert__person").order_by("expert__username", "position")
    sides = {side for pair in waiting for side in (pair.left_id, pair.right_id)}
    # Measured before the transaction: nobody else writes while it lasts.
    errors_m = {
        measured.row.pk: measured.displacement.error_m
        for measured in of_rows(sides)
        if measured.displacement is not None
    }
    rng, cast = np.random.default_rng(seed), 0
    with transaction.atomic():
        for matchup in waiting:
            # A change whose error nobody knows has none.
            shown = matchup.left_id, matchup.right_id
            left_m, right_m = (errors_m.get(key, 0.0) for key in shown)
            for question in study.questions:
                is_primary = question == study.questions[0]
                name = "simulated" if is_primary else f"simulated {question}"
                decision = Decision(
                    matchup=matchup.code,
                    key=uuid5(matchup.code, name),
                    outcome=_judge(right_m - left_m, rng),
                    question=question,
                )
                cast_vote(expert=matchup.expert, decision=decision)
                cast += 1
        if cast:
            log_change(study, "simulate votes", after={"votes": cast, "seed": seed})
    return cast


def _judge(advantage_m: float, rng: np.random.Generator) -> str:
    """The outcome where the left change lies nearer by `advantage_m`."""
    if rng.random() < SLIP:
        return Vote.Outcome.values[rng.integers(3)]
    perceived_m = advantage_m + rng.normal(0.0, NOISE_M)
    if abs(perceived_m) < TIE_M:
        return Vote.Outcome.EQUAL
    return Vote.Outcome.LEFT if perceived_m > 0 else Vote.Outcome.RIGHT
