"""The home page of each role: what is next to do."""

from __future__ import annotations

from typing import cast

from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import redirect, render
from django.utils.http import url_has_allowed_host_and_scheme
from django.views.decorators.http import require_POST, require_safe

from arena.jobs import queries
from arena.models import Study
from arena.queries import inventory
from arena.queries.people import role_of
from arena.queries.studies import progress
from arena.queries.studies.results import ResultsAccess, results_access
from arena.services.preferences import choose_language, choose_theme
from arena.web.forms import LanguageForm, ThemeForm
from arena.web.language import use_english
from arena.web.people.sign_in import keep_language
from arena.web.site.checklist import steps
from augment.models import GenerationJob
from augment.services.running.progress import count_each

LATEST_JOBS = 5


@require_safe
def home(request: HttpRequest) -> HttpResponse:
    """The page of the role that somebody has; without a role, a page that says so."""
    match role_of(request.user):
        case "expert":
            return _expert(request)
        case "analyst":
            use_english(request)
            return _analyst(request)
        case "admin":
            use_english(request)
            return _admin(request)
        case _:
            return render(request, "home/nobody.html")


@require_POST
def theme(request: HttpRequest) -> HttpResponse:
    """Keep how the pages look, then go back to where the switch was pressed."""
    form = ThemeForm(request.POST)
    if form.is_valid():
        choose_theme(user=cast(User, request.user), theme=form.theme_value())
    return _back(request)


@require_POST
def language(request: HttpRequest) -> HttpResponse:
    """Keep the language with the account, and in this browser for the pages before the login."""
    form = LanguageForm(request.POST)
    answer = _back(request)
    if form.is_valid():
        chosen = form.language_value()
        choose_language(user=cast(User, request.user), language=chosen)
        keep_language(answer, chosen)
    return answer


def _back(request: HttpRequest) -> HttpResponse:
    """To where the switch was pressed, if that is a page of ours."""
    back = request.POST.get("next", "")
    is_ours = url_has_allowed_host_and_scheme(back, {request.get_host()}, request.is_secure())
    return redirect(back if is_ours and "/" in back else "home")  # else it names a view


def _expert(request: HttpRequest) -> HttpResponse:
    expert = cast(User, request.user)
    found = progress.of_expert(expert)
    closed = [line for line in found if line.study.state == Study.State.CLOSED]
    is_open = [line for line in found if line.study.state == Study.State.OPEN]
    context = {
        "to_do": [line for line in is_open if line.left],
        "finished": [line for line in is_open if not line.left],
        "closed": closed,
        "cancelled": [line for line in found if line.study.state == Study.State.CANCELLED],
        "labellings": queries.of_expert(expert),
        "readable": {
            line.study.pk: results_access(user=expert, study=line.study) is ResultsAccess.FULL
            for line in closed
        },
    }
    return render(request, "home/expert.html", context)


def _analyst(request: HttpRequest) -> HttpResponse:
    found = progress.of_studies()
    context = {
        "running": [line for line in found if line.study.state == Study.State.OPEN],
        "closed": [line for line in found if line.study.state == Study.State.CLOSED],
    }
    return render(request, "home/analyst.html", context)


def _admin(request: HttpRequest) -> HttpResponse:
    found = inventory.take_inventory()
    studies = progress.of_studies()
    context = {
        "inventory": found,
        "steps": steps(found),
        "jobs": count_each(list(GenerationJob.objects.all()[:LATEST_JOBS])),
        "running": [line for line in studies if line.study.state == Study.State.OPEN],
    }
    return render(request, "home/admin.html", context)
