"""The end of a study: no more votes are taken, and those that there are get rated."""

import uuid

from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect

from arena.models import Study
from arena.results.pages.rating_form import rate_or_send
from arena.shell.access import ADMIN, form_for, get_user
from arena.shell.acts import Confirmation, ask, is_sure, refusals_told
from arena.studies.pages.studies import study_question
from arena.studies.queries import count_progress
from arena.studies.services.opening import close_study


@form_for(ADMIN)
def close_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more votes, rate them with the defaults and show the table; asks first."""
    study = get_object_or_404(Study, code=code)
    if not is_sure(request):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        return ask(request, _closing(study))
    actor = get_user(request)
    with refusals_told(request):
        closed = close_study(study=study, actor=actor)
        if study.state == Study.State.OPEN:  # not pressed twice
            rate_or_send(request, closed, actor=actor)
        return redirect("results", code=code)
    return redirect("study", code=code)


def _closing(study: Study) -> Confirmation:
    (line,) = count_progress([study])
    return study_question(
        study,
        f"Close the study “{study.name}”?",
        f"Votes given: {line.voted}. Pairs skipped: {line.skipped}. Still planned: {line.left}.",
        "No more votes are taken. This can’t be taken back.",
        "Its results can be read then, also by its experts. To end it without any, cancel it.",
        button="Close the study",
    )
