"""Planning a study before there is one: how many votes, how long, and what they will tell."""

from dataclasses import asdict
from typing import Any
from urllib.parse import urlencode

from django.http import HttpRequest, HttpResponse
from django.shortcuts import render
from django.urls import reverse
from django.views.decorators.http import require_safe

from arena.models import Study
from arena.site.access import STAFF, allow_only, user_of
from arena.studies.forms import PlanningForm
from arena.studies.pages.setup import study_asked
from arena.studies.services.outlook import (
    ESTIMATE_INPUTS,
    Known,
    Prospect,
    StudyEstimate,
    foretell,
    known_of,
    usual_seconds,
)
from augment.errors import AugmentError

ON_TOP = ("repeats", "checks", "overlap")
PARTS = {
    "Who and what": ("contestants", "experts", "scenarios"),
    "What is expected": ("spread", "ties", "expert_sd", "scenario_sd", "seconds"),
    "What it is to tell": ("half_width", "gap", "power", "votes_per_expert"),
    "On top": ON_TOP,
}


@allow_only(*STAFF)
@require_safe
def planning_page(request: HttpRequest) -> HttpResponse:
    """The form with its answer below, filled in with what a study at hand says."""
    study, fault = study_asked(request), ""
    seconds = usual_seconds()
    known = Known(values={} if seconds is None else {"seconds": seconds})
    if study is not None:
        try:
            known = known_of(study, user_of(request))
        except AugmentError as error:
            known, fault = Known(values={}), str(error)
    entered = {one.name: value for one in ESTIMATE_INPUTS if (value := request.GET.get(one.name))}
    form = PlanningForm(asdict(StudyEstimate()) | known.values | entered)
    context: dict[str, Any] = {
        "form": form,
        "study": study,
        "studies": Study.objects.all(),
        "known": known,
        "fault": fault,
        "parts": [(title, [form[name] for name in names]) for title, names in PARTS.items()],
    }
    if form.is_valid():
        context["lines"] = [
            {"goal": goal, "address": _new_study(goal.prospect, form.cleaned_data, study)}
            for goal in foretell(StudyEstimate(**form.cleaned_data))
        ]
        context["power"] = f"{form.cleaned_data['power']:g}"
    return render(request, "studies/plan.html", context, status=422 if form.errors else 200)


def _new_study(prospect: Prospect | None, entered: dict[str, Any], study: Study | None) -> str:
    """Return the address of the form of a new study with so many votes."""
    if prospect is None or prospect.votes_per_expert > 10_000:
        return ""
    values: dict[str, Any] = {"votes_per_expert": prospect.votes_per_expert}
    values |= {name: f"{entered[name]:g}" for name in ON_TOP}
    if study is not None:
        values["study"] = study.code
    return f"{reverse('study-new')}?{urlencode(values)}"
