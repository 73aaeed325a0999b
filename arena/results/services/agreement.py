"""Metrics and judge models beside the votes of a study; judges' answers are no votes."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from django.contrib.auth.models import User
from django.db import transaction

from arena.jobs.queries import list_shown_ids
from arena.models import Snapshot, Study
from arena.rating.agreement import (
    AgreementLine,
    NamedRater,
    PairVote,
    measure_agreement,
    rater_by_pairs,
    rater_by_scores,
)
from arena.results.queries.judges import judge_preferences, list_judged_pairs
from arena.results.queries.votes import COUNTED, Filters, RatedVote, current_votes, last_vote_id
from arena.results.services.analysis import SCORES
from arena.voting.queries.blinding import is_imported
from augment.errors import check_names
from augment.models import JudgeRun
from augment.services.judging import metric_scores
from augment.services.running import (
    JudgeEstimate,
    JudgeRequest,
    ShownPair,
    estimate_judge,
    plan_judge,
)


def rater_agreement(snapshot: Snapshot) -> tuple[AgreementLine, ...]:
    """Measure how metrics and judge models agree with the votes of a rating, by question.

    Args:
        snapshot: Says which votes count. Augmentations are scored as they are now; those of votes
            from a file are not known.
    """
    study, filters = snapshot.study, Filters.of_document(snapshot.filters)
    if is_imported(study):
        return ()
    lines: list[AgreementLine] = []
    metrics = [
        rater_by_scores(scores.name, scores.by_code, tolerance=scores.tolerance)
        for scores in metric_scores(list_shown_ids(study))
    ]
    for question in study.questions:
        asked_for = replace(filters, question=question)
        votes = pair_votes(current_votes(study, asked_for, snapshot.last_vote))
        raters = [*metrics, *judge_raters(study, question)]
        lines += [replace(line, question=question) for line in measure_agreement(votes, raters)]
    return tuple(lines)


def pair_votes(votes: Iterable[RatedVote]) -> list[PairVote]:
    """Return the votes that count."""
    return [
        PairVote(
            judge=vote.judge,
            item=vote.item,
            type=vote.type,
            left=vote.left_code,
            right=vote.right_code,
            preference=int(2.0 * SCORES[vote.outcome] - 1.0),
        )
        for vote in votes
        if vote.mark == COUNTED
    ]


def judge_raters(study: Study, question: str) -> list[NamedRater]:
    """Return the models that compared the pairs of a study by a question."""
    judges = judge_preferences(study, question)
    return [rater_by_pairs(name, preferences) for name, preferences in judges.items()]


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
