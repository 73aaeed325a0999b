"""Sweeps and families of a scenario: started, followed, read."""

import uuid
from typing import Any
from urllib.parse import urlencode

from django import forms
from django.contrib import messages
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify

from arena.exports.formats import download
from arena.scenarios.exports.sweeps import SWEEP_FORMATS
from arena.scenarios.pages.augmentations import find_scenario
from arena.shell import acts
from arena.shell.access import ADMIN, STAFF, act_for, form_for, get_user, page_for
from arena.shell.forms import RequestForm, offer
from arena.shell.pictures import charts_for_pages
from augment.models import Scenario, Sweep
from augment.services import read_request, to_inputs
from augment.services.driving import driver_name, list_allowed_planners, sweep_result, sweeps

KEPT = ("number", "low", "high", "count", "planner", "offsets", "is_reactive")
"""What the form of a new sweep is filled in with by an address."""


class SweepForm(RequestForm):
    """Number of a scenario that is swept."""

    inputs = to_inputs(sweeps.SweepRequest)
    number = forms.ChoiceField(label="Number")
    planner = forms.ChoiceField(label="Planner under test")

    def __init__(self, scenario: Scenario, data: Any = None, **more: Any) -> None:
        super().__init__(data, **more)
        numbers = sweeps.swept_numbers(scenario).items()
        offer(self, "number", [(name, f"{name} (now {value:g})") for name, value in numbers])
        offer(self, "planner", [(name, name) for name in list_allowed_planners()])


class FamilyForm(forms.Form):
    """Number of scenarios to draw."""

    count = forms.IntegerField(
        label="Scenarios", min_value=1, max_value=sweeps.LARGEST_FAMILY, initial=10
    )
    seed = forms.IntegerField(label="Seed", min_value=0, max_value=2**31 - 1, initial=0)


@page_for(*STAFF)
def sweeps_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """List the sweeps of a scenario, with the forms of a new one and of a family."""
    scenario = find_scenario(code)
    initial = {name: request.GET[name] for name in KEPT if name in request.GET}
    context = {
        "scenario": scenario,
        "sweeps": [(row, driver_name(row)) for row in scenario.sweeps.select_related("hardest")],
        "form": SweepForm(scenario, initial=initial),
        "family": FamilyForm(auto_id="family_%s"),
    }
    return render(request, "scenarios/sweeps.html", context)


@act_for(ADMIN, back="sweeps")
def start_sweep(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have the values driven by the workers."""
    scenario = find_scenario(code)
    form = SweepForm(scenario, request.POST)
    if not form.is_valid():
        acts.tell_errors(request, form)
    else:
        with acts.refusals_told(request):
            wanted = read_request(sweeps.SweepRequest, form.cleaned_data)
            sweep = sweeps.plan_sweep(scenario=scenario, request=wanted, actor=get_user(request))
            acts.send_later(request, sweep)
            return redirect("sweep", code=sweep.code)
    query = urlencode({name: request.POST.get(name, "") for name in KEPT})
    return redirect(f"{reverse('sweeps', args=[code])}?{query}")


@act_for(*STAFF, back="sweeps")
def draw_family(request: HttpRequest, code: uuid.UUID) -> None:
    """Add scenarios with numbers drawn from the intent's ranges."""
    form = FamilyForm(request.POST)
    if not form.is_valid():
        acts.tell_errors(request, form)
        return
    rows, refused = sweeps.add_family(
        scenario=find_scenario(code), **form.cleaned_data, actor=get_user(request)
    )
    for row in rows:
        acts.send_later(request, row)
    for member in refused:
        messages.warning(request, f"Refused: {member.refusal}")
    if rows:
        names = f"{rows[0].slug} to {rows[-1].slug}" if rows[1:] else rows[0].slug
        messages.success(request, f"{len(rows)} added: {names}.")


@page_for(*STAFF)
def sweep_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show the curve of a sweep, where the planner fails, and every drive."""
    sweep = _sweep(code)
    result = sweep_result(sweep)
    context = {
        "sweep": sweep,
        "driver": driver_name(sweep),
        "result": result,
        "planned": result.planned,
        "done": result.planned - result.under_way,
        "finer": sorted(result.edges[0]) if result.edges else (),
        "forms": list(SWEEP_FORMATS),
        **acts.wait_for_workers(waits=bool(result.under_way)),
    }
    return render(request, "scenarios/sweep.html", context)


@page_for(*STAFF)
@charts_for_pages
def sweep_file(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """Answer with the table or the curve as a file."""
    sweep = _sweep(code)
    stem = f"sweep-{sweep.scenario.slug}-{slugify(sweep.number)}"
    return download(SWEEP_FORMATS, form, stem, sweep_result(sweep))


@form_for(ADMIN)
def remove_sweep(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Delete a sweep with its drives, once that is confirmed."""
    sweep = _sweep(code)
    if not acts.is_sure(request):
        question = acts.Confirmation(
            title=f"Delete the sweep of {sweep.number}?",
            facts=("Its drives are deleted with it; a scenario that it kept stays.",),
            button="Delete",
            back=reverse("sweep", args=[code]),
        )
        return acts.ask(request, question)
    sweeps.delete_sweep(sweep, actor=get_user(request))
    messages.success(request, f"The sweep of {sweep.number} is deleted.")
    return redirect("sweeps", code=sweep.scenario.code)


# --- Private -----------------------------------------------------------------------------------


def _sweep(code: uuid.UUID) -> Sweep:
    return get_object_or_404(Sweep.objects.select_related("scenario", "hardest"), code=code)
