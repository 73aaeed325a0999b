"""Judges of a study: started and cancelled; what they say is kept apart from all votes."""

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Study
from arena.results.queries.judges import judged_pairs
from augment.models import JudgeRun
from augment.services.events import log_change
from augment.services.running.judge_runs import (
    JudgeEstimate,
    JudgeRequest,
    estimate_judge,
    plan_judge,
)


def estimate_study_judge(study: Study, request: JudgeRequest) -> JudgeEstimate:
    """Return what a judge of all pairs that experts judged would use.

    Raises:
        UnknownName: No such endpoint.
        Conflict: The model can't see pictures.
    """
    texts = study.scenarios.values_list("instruction", flat=True)
    return estimate_judge(request, len(judged_pairs(study)), max(texts, key=len, default=""))


@transaction.atomic
def start_judge(study: Study, request: JudgeRequest, actor: User | None = None) -> JudgeRun:
    """Let a model compare all pairs that experts judged; workers ask it.

    Raises:
        UnknownName: No such endpoint.
        InvalidDocument: A cap can't be.
        Conflict: There is no such pair, the model can't see, or a cap in USD lacks a price.
    """
    run = plan_judge(request, judged_pairs(study), actor)
    study.judges.add(run)
    log_change(
        study, "start judge", actor, after={"judge": str(run), "pairs": run.judgements.count()}
    )
    return run
