"""Experts' acts beside voting: practice before their first pair, and reports of problems.

Neither changes a vote; no rating, progress or export of votes sees answers to practice pairs.
"""

import random
from collections import Counter
from dataclasses import dataclass
from uuid import UUID

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.db.models import QuerySet

from arena.errors import InvalidVote, NothingToPlan, NotYours, StudyNotOpen
from arena.models import Matchup, PracticePair, Report, Study, Vote
from arena.studies.services.pictures import latest_pairs
from arena.voting.queries.ballots import own_matchup, require_open
from arena.voting.services.casting import LONGEST_COMMENT
from augment.errors import Conflict
from augment.models import Scenario
from augment.services.texts import make_storable

PAIRS = 5
SIDES = {"A": Report.Side.LEFT, "B": Report.Side.RIGHT, "both": Report.Side.BOTH}
"""What a browser says of a side: the left picture is A."""

Answer = PracticePair.Answer

# --- Practice ----------------------------------------------------------------------------------


def is_due(study: Study, expert: User) -> bool:
    """Return whether the expert practises now: nothing is voted yet and a pair is unanswered."""
    if not study.practice or Vote.objects.filter(matchup__study=study, expert=expert).exists():
        return False
    return any(not pair.answer for pair in practice_pairs(study, expert))


@transaction.atomic
def practice_pairs(study: Study, expert: User) -> list[PracticePair]:
    """Return the expert's round, made when it is first asked for.

    Scenarios that are not in the study come first; of each group one of every type comes before a
    second one.
    """
    rows = PracticePair.objects.filter(study=study, expert=expert).order_by("position")
    rows = rows.select_related("scenario__base_scene", "good", "broken")
    if study.practice and study.state == Study.State.OPEN and not rows.exists():
        # Two windows of one browser may ask at once.
        Study.objects.select_for_update().get(pk=study.pk)
        if not rows.exists():
            PracticePair.objects.bulk_create(_draw_round(study, expert))
    return list(rows)


def answer_practice(
    *, study: Study, expert: User, position: str | None, answer: str | None
) -> PracticePair:
    """Keep what an expert answered; the first answer to a pair stays.

    Raises:
        InvalidVote: It is no answer, or there is no such pair.
        StudyNotOpen: The study is over.
    """
    if answer not in (Answer.LEFT, Answer.EQUAL, Answer.RIGHT):
        raise InvalidVote({"outcome": "It is none of the answers."})
    pairs = {str(pair.position): pair for pair in practice_pairs(study, expert)}
    if position not in pairs:
        raise InvalidVote({"pair": "It is no pair of the round."})
    pair = pairs[position]
    _open_practice(study, expert).filter(pk=pair.pk).update(answer=answer)
    return pair


def skip_practice(*, study: Study, expert: User) -> None:
    """End the round for good.

    Raises:
        StudyNotOpen: The study is over.
    """
    _open_practice(study, expert).update(answer=Answer.SKIPPED)


def has_practice() -> bool:
    """Return whether there is something to practise on."""
    return bool(latest_pairs(Scenario.objects.all()))


def require_practice_pictures() -> None:
    """Raise NothingToPlan, with what to do, where there is nothing to practise on."""
    if not has_practice():
        raise NothingToPlan(
            "There is nothing to practise on yet: no scenario has a picture of its reference "
            "and a broken one. Generate the contestant reference and press “Draw missing "
            "attention checks” on the page of a new study, or open it without practice."
        )


def _open_practice(study: Study, expert: User) -> QuerySet[PracticePair]:
    require_open(study)
    return PracticePair.objects.filter(study=study, expert=expert, answer="")


def _draw_round(study: Study, expert: User) -> list[PracticePair]:
    own = set(study.scenarios.values_list("pk", flat=True))
    shown = latest_pairs(Scenario.objects.all()).values()
    pairs = {good.scenario_id: (good, broken) for good, broken in shown}
    type_of = dict(Scenario.objects.filter(pk__in=pairs).values_list("pk", "type"))
    dice = random.Random(f"{study.seed} {UUID(str(expert.person.code)).int}")
    order = sorted(pairs)
    dice.shuffle(order)
    drawn: Counter[tuple[bool, str]] = Counter()
    ranked = []
    for number, pk in enumerate(order):
        group = (pk in own, type_of[pk])
        ranked.append((pk in own, drawn[group], number, pk))
        drawn[group] += 1
    return [
        PracticePair(
            study=study,
            expert=expert,
            position=position,
            scenario_id=pk,
            good=pairs[pk][0],
            broken=pairs[pk][1],
            good_is_left=dice.random() < 0.5,
        )
        for position, (*_, pk) in enumerate(sorted(ranked)[:PAIRS], start=1)
    ]


# --- Reports -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Complaint:
    """A report of an expert on a matchup.

    Attributes:
        key: Made by the browser, one per report.
        matchup: One of the expert's own.
        side: Which picture it is about, one of Report.Side.

    Raises:
        InvalidVote: Parts are unknown or too long.
    """

    key: UUID
    matchup: UUID
    reason: str
    side: str = Report.Side.BOTH
    comment: str = ""

    def __post_init__(self) -> None:
        faults = {}
        for name, known in (("reason", Report.Reason.values), ("side", Report.Side.values)):
            if getattr(self, name) not in known:
                faults[name] = f"One of these is needed: {', '.join(known)}."
        if len(self.comment) > LONGEST_COMMENT:
            faults["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
        if faults:
            raise InvalidVote(faults)


def report(*, expert: User, complaint: Complaint) -> Report:
    """Keep what an expert reports; the same key again is the same report.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        StudyNotOpen: The study is over.
        Conflict: The key belongs to another report.
    """
    matchup = own_matchup(expert=expert, code=complaint.matchup)
    stored = Report.objects.filter(key=complaint.key).first()
    if stored is None:
        if matchup.study.state != Study.State.OPEN:
            raise StudyNotOpen(f"The study {matchup.study.name!r} is {matchup.study.state}.")
        stored = _insert(matchup, expert, complaint)
    content = (matchup.pk, complaint.reason, complaint.side)
    if (stored.matchup_id, stored.reason, stored.side) != content:
        raise Conflict("This key belongs to another report; make a new key for every report.")
    return stored


def _insert(matchup: Matchup, expert: User, complaint: Complaint) -> Report:
    values = {
        "matchup": matchup,
        "expert": expert,
        "reason": complaint.reason,
        "side": complaint.side,
        "comment": make_storable(complaint.comment.strip()),
    }
    try:
        return Report.objects.get_or_create(key=complaint.key, defaults=values)[0]
    except IntegrityError:  # the pair was handed over at this moment
        raise NotYours("This matchup is not yours.") from None
