"""The practice round before an expert's first pair of a study.

In: a study with the rule and an expert. Out: up to five `PracticePair`s, made once; answers to
them, which no rating, progress or export of votes ever sees.
"""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import dataclass
from uuid import UUID

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.db.models import F

from arena.errors import InvalidVote, NothingToPlan, NotYours, StudyNotOpen
from arena.models import Matchup, PracticePair, Report, Study, Vote
from arena.queries.voting.ballots import matchup_of
from arena.services.decisions import LONGEST_COMMENT
from arena.studies.services.pictures import find_showable
from augment.errors import Conflict
from augment.models import Augmentation, Contestant, Scenario
from augment.services.scenarios.pictures import window_of
from augment.services.texts import make_storable

PAIRS = 5

_GOOD, _BROKEN = Contestant.Kind.REFERENCE, Contestant.Kind.CHECK
Answer = PracticePair.Answer


def is_due(study: Study, expert: User) -> bool:
    """Whether the expert practises now: the study wants it, nothing is voted, a pair is open."""
    if not study.practice or study.state != Study.State.OPEN:
        return False
    if Vote.objects.filter(matchup__study=study, expert=expert).exists():
        return False
    return any(not pair.answer for pair in practice_pairs(study, expert))


@transaction.atomic
def practice_pairs(study: Study, expert: User) -> list[PracticePair]:
    """The expert's round, made when it is first asked for; empty where nothing can be shown.

    Scenarios that are not in the study come first, then the study's own; of each group one of
    every type before a second one.
    """
    mine = PracticePair.objects.filter(study=study, expert=expert).order_by("position")
    kept = list(mine.select_related("scenario__base_scene", "good", "broken"))
    if kept or not study.practice or study.state != Study.State.OPEN:
        return kept
    # Two windows of one browser may ask at once.
    Study.objects.select_for_update().get(pk=study.pk)
    if not mine.exists():
        PracticePair.objects.bulk_create(_drawn(study, expert))
    return list(mine.select_related("scenario__base_scene", "good", "broken"))


@transaction.atomic
def answer_practice(*, study: Study, expert: User, position: int, answer: str) -> None:
    """Keep what an expert answered; the first answer to a pair stays.

    Raises:
        InvalidVote: It is no answer.
        StudyNotOpen: The study is over.
    """
    if answer not in (Answer.LEFT, Answer.EQUAL, Answer.RIGHT):
        raise InvalidVote({"outcome": "It is none of the answers."})
    _check_open(study)
    PracticePair.objects.filter(study=study, expert=expert, position=position, answer="").update(
        answer=answer
    )


def skip_practice(*, study: Study, expert: User) -> None:
    """End the round; it does not come again.

    Raises:
        StudyNotOpen: The study is over.
    """
    _check_open(study)
    PracticePair.objects.filter(study=study, expert=expert, answer="").update(
        answer=Answer.SKIPPED
    )


def has_practice() -> bool:
    """Whether there is something to practise on."""
    return bool(_ready())


def require_practice_pictures() -> None:
    """Do nothing where there is something to practise on.

    Raises:
        NothingToPlan: There is not; the text says what to do.
    """
    if not has_practice():
        raise NothingToPlan(
            "There is nothing to practise on yet: no scenario has a picture of its reference "
            "and a broken one. Generate the contestant reference and press “Draw missing "
            "attention checks” on the page of a new study, or open it without a practice "
            "round."
        )


# --- Private -----------------------------------------------------------------------------------


def _check_open(study: Study) -> None:
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study {study.name!r} takes no votes: it is {study.state}.")


def _drawn(study: Study, expert: User) -> list[PracticePair]:
    own = set(study.scenarios.values_list("pk", flat=True))
    others = Study.objects.filter(experts=expert, state=Study.State.OPEN)
    seen = set(others.values_list("scenarios", flat=True)) - own
    ready = _ready()
    kinds = dict(Scenario.objects.filter(pk__in=ready).values_list("pk", "type"))
    dice = random.Random(f"{study.seed} {UUID(str(expert.person.code)).int}")
    order = sorted(ready)
    dice.shuffle(order)
    types: Counter[tuple[int, str]] = Counter()
    ranked = []
    for number, pk in enumerate(order):
        group = 2 if pk in own else int(pk in seen)
        ranked.append((group, types[group, kinds[pk]], number, pk))
        types[group, kinds[pk]] += 1
    chosen = [pk for *_, pk in sorted(ranked)[:PAIRS]]
    return [
        PracticePair(
            study=study,
            expert=expert,
            position=position,
            scenario_id=pk,
            good=ready[pk][0],
            broken=ready[pk][1],
            good_is_left=dice.random() < 0.5,
        )
        for position, pk in enumerate(chosen, start=1)
    ]


def _ready() -> dict[int, tuple[Augmentation, Augmentation]]:
    """By scenario: its latest reference and its latest broken picture, in one window."""
    rows = find_showable(list(Scenario.objects.only("pk"))).filter(
        contestant__kind__in=[_GOOD, _BROKEN], state=Augmentation.State.DONE
    )
    latest: dict[tuple[int, str], Augmentation] = {}
    for row in rows.order_by(F("finished_at").asc(nulls_first=True), "pk"):
        latest[row.scenario_id, row.contestant.kind] = row
    found = {}
    for scenario in {pk for pk, _ in latest}:
        good, broken = latest.get((scenario, _GOOD)), latest.get((scenario, _BROKEN))
        if good is None or broken is None or good.image == broken.image:
            continue
        if window_of(good.image) == window_of(broken.image):
            found[scenario] = (good, broken)
    return found


SIDES = {"A": Report.Side.LEFT, "B": Report.Side.RIGHT, "both": Report.Side.BOTH}
"""What a browser says of a side: the left picture is A."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Complaint:
    """What an expert reports.

    Attributes:
        reason: One of Report.Reason.
        side: One of Report.Side.
        mark: A place in the named pictures, as shares of their width and height from the upper
            left corner; None without one.
        comment: What is wrong.
    """

    reason: str
    side: str = Report.Side.BOTH
    mark: tuple[float, float] | None = None
    comment: str = ""


def report(*, expert: User, matchup_code: UUID | str, key: UUID, said: Complaint) -> Report:
    """Keep what an expert reports; the same key again is the same report.

    Args:
        expert: Whose report it is.
        matchup_code: What it is about; one of the expert's own matchups.
        key: Made by the browser, one per report.
        said: What is wrong, and where.

    Raises:
        NotYours: The matchup is somebody else's or does not exist.
        InvalidVote: Reason or side are unknown, the mark lies beside the pictures, or the comment
            is too long.
        StudyNotOpen: The study is over.
        Conflict: The key belongs to another report.
    """
    check_complaint(said)
    matchup = matchup_of(expert=expert, code=matchup_code)
    stored = Report.objects.filter(key=key).first()
    if stored is None:
        if matchup.study.state != Study.State.OPEN:
            raise StudyNotOpen(f"The study {matchup.study.name!r} is {matchup.study.state}.")
        stored = _insert(matchup, expert, key, said)
    same = (matchup.pk, said.reason, said.side)
    if (stored.matchup_id, stored.reason, stored.side) != same:
        raise Conflict("This key belongs to another report; make a new key for every report.")
    return stored


def check_complaint(said: Complaint) -> None:
    """Refuse parts that are unknown or too long, with an InvalidVote."""
    wrong = {}
    if said.reason not in Report.Reason.values:
        wrong["reason"] = f"One of these is needed: {', '.join(Report.Reason.values)}."
    if said.side not in Report.Side.values:
        wrong["side"] = f"One of these is needed: {', '.join(Report.Side.values)}."
    if said.mark is not None and not all(0 <= share <= 1 for share in said.mark):
        wrong["mark"] = "Both numbers of a mark lie between 0 and 1."
    if len(said.comment) > LONGEST_COMMENT:
        wrong["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
    if wrong:
        raise InvalidVote(wrong)


def _insert(matchup: Matchup, expert: User, key: UUID, said: Complaint) -> Report:
    across, down = said.mark or (None, None)
    try:
        with transaction.atomic():
            return Report.objects.create(
                key=key,
                matchup=matchup,
                expert=expert,
                reason=said.reason,
                side=said.side,
                mark_x=across,
                mark_y=down,
                comment=make_storable(said.comment.strip()),
            )
    except IntegrityError:
        same = Report.objects.filter(key=key).first()
        if same is None:  # the pair was handed over at this moment
            raise NotYours("This matchup is not yours.") from None
        return same  # it arrived twice at once
