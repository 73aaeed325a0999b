"""Planning a study before there is one: how many votes, how long, and what they will tell."""

from dataclasses import asdict
from typing import Any

from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render

from arena.models import Study
from arena.site.access import STAFF, page_for, user_of
from arena.site.acts import refusals_told
from arena.studies.forms import PlanningForm
from arena.studies.services.outlook import ESTIMATE_INPUTS, StudyEstimate, foretell, known_of


@page_for(*STAFF)
def planning_page(request: HttpRequest) -> HttpResponse:
    """The form with its answer below, filled in with what a study at hand says."""
    study, values = None, asdict(StudyEstimate())
    if name := request.GET.get("study"):
        study = get_object_or_404(Study, name=name)
        with refusals_told(request):
            values |= known_of(study, user_of(request))
    names = [field.name for field in ESTIMATE_INPUTS]
    values |= {name: given for name in names if (given := request.GET.get(name))}
    form = PlanningForm(values)
    context: dict[str, Any] = {"form": form, "study": study, "studies": Study.objects.all()}
    if form.is_valid():
        context["goals"] = foretell(StudyEstimate(**form.cleaned_data))
    return render(request, "studies/plan.html", context, status=422 if form.errors else 200)
