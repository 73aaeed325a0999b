"""Practice before an expert's first pair; no rating and no export of votes sees its answers."""

import random
from collections import Counter
from uuid import UUID

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import QuerySet

from arena.errors import InvalidVote
from arena.models import EnrolledVoter, Invitation, PracticePair, Study, Vote
from arena.voting.queries.ballots import require_open
from arena.voting.services.pictures import latest_pairs
from augment.models import Scenario

PAIRS = 5
OF_LINKS = "links"
"""What the rules of a study call it that only who came by a link practises; earlier studies have
everybody do so."""

Answer = PracticePair.Answer


def is_due(study: Study, expert: User) -> bool:
    """Return whether the expert practises now: nothing is voted yet and a pair is unanswered."""
    if not study.practice or Vote.objects.filter(matchup__study=study, expert=expert).exists():
        return False
    if study.rules.get("practice_for") == OF_LINKS:
        # An invitation has let the expert in, or the link of a study for everybody.
        invited = Invitation.objects.filter(expert=expert, used_at__isnull=False)
        if not (invited.exists() or EnrolledVoter.objects.filter(expert=expert).exists()):
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
