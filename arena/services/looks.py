"""The stopping rule of a study at work: looks that are due are taken, and nobody sees results.

What a look keeps is how wide the widest interval was, not whose: no contestant's number leaves it.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

from django.db import transaction
from django.utils import timezone

from arena.models import Matchup, Study, Vote
from arena.queries.judged import last_vote_of
from arena.queries.vote_sets import Filters, vote_set
from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import Leaderboard, rate
from arena.rating.stopping import StoppingRule, look_levels, widest_half_width
from arena.services.studies import close_study
from arena.services.vote_arrays import vote_arrays
from augment.services.events import log_event
from augment.services.running.workers import Survived

logger = logging.getLogger(__name__)

ROUNDS = 1000
"""They only say who is determined at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookLine:
    """One look: what it saw, or when it will be.

    Attributes:
        votes: Counted at the look, or planned for it.
        widest: Points; None where some interval was open or the look is still to come.
    """

    number: int
    votes: int
    is_done: bool = False
    widest: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StoppingProgress:
    """A stopping rule and how far it is.

    Attributes:
        last: The votes at which the study closes at the latest.
        votes: Counted now.
    """

    rule: StoppingRule
    last: int
    votes: int
    lines: tuple[LookLine, ...]
    is_met: bool


def stopping_rule(study: Study) -> StoppingRule | None:
    """The rule that was frozen at the opening, None without."""
    kept = study.rules.get("stopping")
    return None if kept is None else StoppingRule(**kept)


def stopping_progress(study: Study) -> StoppingProgress | None:
    """How far the rule is, None without one."""
    rule = stopping_rule(study)
    if rule is None:
        return None
    done = [
        LookLine(number=number, votes=look["votes"], is_done=True, widest=look["widest"])
        for number, look in enumerate(study.looks, 1)
    ]
    reached = done[-1].votes if done else 0
    coming = [votes for votes in rule.look_votes(_planned(study)) if votes > reached]
    lines = done + [
        LookLine(number=len(done) + number, votes=votes) for number, votes in enumerate(coming, 1)
    ]
    return StoppingProgress(
        rule=rule,
        last=rule.last_votes(_planned(study)),
        votes=_counted(study),
        lines=tuple(lines),
        is_met=any(look["met"] for look in study.looks),
    )


def take_due_looks() -> list[Study]:
    """Take the look of every open study whose votes have reached it.

    One that breaks is logged, keeps no other study from its look, and is tried again next time.

    Returns:
        The studies at which somebody looked.
    """
    is_open = Study.objects.filter(state=Study.State.OPEN, rules__has_key="stopping")
    looked = []
    for study in is_open.order_by("pk"):
        with Survived() as look:
            if take_look(study):
                looked.append(study)
        if look.fault is not None:
            logger.warning("The look at study %s broke: %s", study.code, look.fault)
    return looked


def take_look(study: Study) -> bool:
    """Take the look that is due, and do what the rule says; False where none is due.

    Two workers that come to it at once take one look. Votes that came in since the point count
    as well: the level of a look follows from the votes that it has.
    """
    rule = stopping_rule(study)
    if rule is None or study.state != Study.State.OPEN or any(one["met"] for one in study.looks):
        return False
    votes, number = _counted(study), len(study.looks)
    reached = study.looks[-1]["votes"] if study.looks else 0
    planned = _planned(study)
    if not any(reached < point <= votes for point in rule.look_votes(planned)):
        return False
    look = _looked(study, rule, votes, planned)
    with transaction.atomic():
        held = Study.objects.select_for_update().get(pk=study.pk)
        if held.state != Study.State.OPEN or len(held.looks) != number:
            return False
        held.looks = [*held.looks, look]
        held.save(update_fields=["looks"])
        log_event(
            actor=None,
            verb="look",
            object_kind="study",
            object_code=held.code,
            after={**look, "number": number + 1},
        )
        if look["met"] and rule.closes:
            close_study(study=held)
    return True


# --- Private -----------------------------------------------------------------------------------


def _planned(study: Study) -> int:
    return len(study.rules["experts"]) * study.votes_per_expert


def _counted(study: Study) -> int:
    """Main votes that stand and are no skips."""
    votes = Vote.objects.filter(
        matchup__study=study, matchup__kind=Matchup.Kind.MAIN, superseded_by=None
    )
    return votes.exclude(outcome=Vote.Outcome.SKIP).count()


def _looked(study: Study, rule: StoppingRule, votes: int, planned: int) -> dict[str, Any]:
    """What the look keeps: votes, level, the widest interval, whether the rule is met."""
    last = rule.last_votes(planned)
    shares = [min(one["votes"] / last, 1.0) for one in study.looks] + [min(votes / last, 1.0)]
    level = look_levels(shares)[-1]
    widest = None
    if rule.half_width is not None:
        widest = widest_half_width(_board(study), level)
    is_narrow = rule.half_width is not None and widest is not None and widest <= rule.half_width
    return {
        "votes": votes,
        "at": timezone.now().isoformat(),
        "level": round(level, 6),
        "widest": None if widest is None else round(widest, 1),
        "met": is_narrow or votes >= last,
    }


def _board(study: Study) -> Leaderboard:
    """The rating that the study's results would begin with; nothing of it is kept."""
    votes = vote_set(study, filters=Filters(), last=last_vote_of(study))
    names = [one.slug for one in votes.entrants]
    arrays = vote_arrays(names, votes.counted)
    return rate(arrays.comparisons, unit=Unit.TWO_WAY, rounds=ROUNDS, seed=study.seed)
