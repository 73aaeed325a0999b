"""Judges of a study: started, and held against experts. What they say is kept apart from votes."""

from collections.abc import Mapping

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Study
from arena.rating.agreement import AgreementLine, measure_agreement
from arena.results.queries.judges import list_judged_pairs
from arena.results.queries.votes import Filters, current_votes, last_vote_id
from arena.results.services.agreement import judge_raters, pair_votes
from augment.errors import check_names
from augment.models import JudgeRun
from augment.services.running import (
    JudgeEstimate,
    JudgeRequest,
    ShownPair,
    estimate_judge,
    plan_judge,
)


def estimate_study_judge(study: Study, request: JudgeRequest) -> JudgeEstimate:
    """Return the estimate of a judge of all pairs that experts judged.

    Raises:
        UnknownName: No such endpoint, or the study does not ask that question.
        Conflict: The model can't see pictures.
    """
    texts = study.scenarios.values_list("instruction", flat=True)
    pairs = _pairs(study, request.question)
    return estimate_judge(request, len(pairs), max(texts, key=len, default=""))


@transaction.atomic
def start_judge(study: Study, request: JudgeRequest, actor: User | None = None) -> JudgeRun:
    """Let a model compare all pairs that experts judged; workers ask it.

    Raises:
        UnknownName: No such endpoint, or the study does not ask that question.
        InvalidDocument: A cap can't be.
        Conflict: There is no such pair, the model can't see, or a cap in USD lacks a price.
    """
    run = plan_judge(request, _pairs(study, request.question), actor)
    study.judges.add(run)
    return run


def judge_agreement(study: Study, question: str) -> Mapping[str, AgreementLine]:
    """Return by its name how each judge agrees with all votes that count, with experts and a coin.

    The same is measured for a rating, whose votes are those of its time. Nothing without judges.
    """
    raters = judge_raters(study, question)
    if not raters:
        return {}
    votes = current_votes(study, Filters(question=question), last_vote_id(study))
    lines = measure_agreement(pair_votes(votes), raters)
    return {line.rater: line for line in lines if not line.type}


def _pairs(study: Study, question: str) -> list[ShownPair]:
    check_names("question of this study", [question], study.questions)
    return list_judged_pairs(study, question)
