"""The page of a new job: choose, see what it would use, try one scenario first, launch."""

from dataclasses import replace
from decimal import Decimal
from functools import cached_property
from typing import Any

from django import forms
from django.contrib import messages
from django.db import transaction
from django.http import HttpRequest, HttpResponse
from django.shortcuts import redirect, render

from arena.contestants.pages import OptionsForm
from arena.scenarios.queries import by_type, set_asked, set_choices
from arena.shell.access import ADMIN, form_for, get_user
from arena.shell.acts import refusals_in, send_later
from arena.shell.forms import ChoiceForm, Offer, offer
from augment.models import Contestant, EndpointModel, GenerationJob, Scenario
from augment.services import read_code, read_request, read_values, running, to_inputs
from augment.services.endpoints import OPTION_INPUTS
from augment.services.running.estimates import estimate
from augment.services.running.jobs import launch

LONGEST_NAME = 120
USUAL_CALLS = 5_000


class LaunchForm(ChoiceForm, OptionsForm):
    """A new job: cells of the matrix, contestants, scenarios and caps."""

    inputs = to_inputs(running.JobRequest) + OPTION_INPUTS
    contestants = forms.MultipleChoiceField(required=False)
    cells = forms.MultipleChoiceField(required=False)

    def __init__(self, *args: Any, models: list[EndpointModel], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.models = models
        self.matrix = running.make_matrix(models)
        keys = [cell.key for cells in self.matrix.values() for cell in cells if not cell.obstacle]
        offer(self, "cells", [(key, key) for key in keys])
        self.fields["samples"].required = False
        self.cells_chosen: list[Contestant] = []

    def clean_samples(self) -> int:
        """Return 1 for an empty field."""
        return self.cleaned_data["samples"] or 1

    def clean(self) -> dict[str, Any]:
        """Check that somebody is chosen, by name or by a cell, and the options of the cells."""
        cleaned = super().clean()
        if not (cleaned.get("contestants") or cleaned.get("cells")):
            self.add_error("contestants", "Choose at least one contestant.")
        with refusals_in(self):
            self.cells_chosen = running.find_cells(
                cleaned.get("cells", []), read_values(OPTION_INPUTS, cleaned)
            )
        return cleaned

    @cached_property
    def offers(self) -> list[Offer]:
        """For the template: contestants, with the reason where no job can run them."""
        return [Offer(row=row, obstacle=running.find_obstacle(row)) for row in self.offered]

    def usual(self) -> dict[str, Any]:
        """Return the initial choice: all that can run on every scenario, within a cap."""
        shown = [row.pk for group in self.groups for row in group.scenarios]
        where = Scenario.objects.filter(pk__in=shown).only("slug", "reference")
        ready = [
            row.slug
            for row in self.offered
            if running.can_run(row, where)
            and getattr(row.endpoint, "key_variable", "") not in self.missing_keys
        ]
        return {
            "name": f"Job {GenerationJob.objects.count() + 1}",
            "contestants": ready,
            "types": [group.type for group in self.groups],
            "cap_calls": USUAL_CALLS,
        }

    @cached_property
    def missing_keys(self) -> set[str]:
        """For the template: variables of the models' keys that the workers do not have."""
        names = {model.endpoint.key_variable for model in self.models} - {""}
        return names - running.workforce().keys

    @property
    def chosen_cells(self) -> list[str]:
        """For the template: the keys that are ticked."""
        return list(self["cells"].value() or ())

    def list_chosen_rows(self) -> list[Contestant]:
        """Return whoever is chosen, each once; those of cells may not be stored yet."""
        named = Contestant.objects.filter(slug__in=self.cleaned_data.get("contestants", []))
        rows = [*named.select_related("endpoint"), *self.cells_chosen]
        return list({row.slug: row for row in rows}.values())

    def find_estimate(self) -> running.JobEstimate | None:
        """Return the job's estimate from the fields chosen so far, without a name or caps."""
        self.is_valid()
        for name in ("name", "contestants", "scenarios"):
            self.errors.pop(name, None)
        contestants = self.list_chosen_rows()
        if not (contestants and self.cleaned_data.get("scenarios")):
            return None
        return estimate(read_request(running.JobScope, self.cleaned_data), contestants)


@form_for(ADMIN)
def new_job_page(request: HttpRequest) -> HttpResponse:
    """Choose contestants and scenarios, then launch."""
    contestants = Contestant.objects.filter(retired_at=None).select_related("endpoint")
    models = EndpointModel.objects.select_related("endpoint")
    chosen_set = set_asked(request.GET.get("set"))
    form = LaunchForm(
        request.POST or None,
        contestants=list(contestants.order_by("name")),
        groups=by_type(chosen_set),
        models=list(models.order_by("endpoint__label", "model")),
    )
    context: dict[str, Any] = {"form": form, "sets": set_choices(chosen_set)}
    if not form.is_bound:
        form.initial = _like(request) or form.usual()
    if "estimate" in request.POST:  # nothing is launched: the form comes back as it came in
        with refusals_in(form):
            context |= {"estimate": form.find_estimate()}
            context |= {"cap_usd": form.cleaned_data.get("cap_usd")}
        return render(request, "jobs/new.html", context)
    if form.is_bound and form.is_valid():
        with refusals_in(form), transaction.atomic():
            job = _launch(request, form)
            send_later(request, job)
            messages.success(request, f"“{job.name}” is launched.")
            return redirect("job", code=job.code)
    return render(request, "jobs/new.html", context, status=422 if form.errors else 200)


def _like(request: HttpRequest) -> dict[str, Any]:
    """Return the values of another job where the address names one."""
    code = request.GET.get("like", "")
    job = GenerationJob.objects.filter(code=read_code(code)).first() if code else None
    if job is None:
        return {}
    names = ("samples", "is_fresh", "cap_calls", "cap_tokens")
    like: dict[str, Any] = {name: getattr(job, name) for name in names}
    like |= {
        "name": f"{job.name} (2)"[:LONGEST_NAME],
        "contestants": list(job.contestants.values_list("slug", flat=True)),
        "scenarios": list(job.scenarios.values_list("slug", flat=True)),
    }
    if job.cap_usd is not None:
        like["cap_usd"] = f"{job.cap_usd.normalize():f}"
    is_all = request.GET.get("all") == "1"
    return like | (job.full_plan or {}) if is_all else like


def _launch(request: HttpRequest, form: LaunchForm) -> GenerationJob:
    """Launch the job; of one that tries first, one scenario with a memory of the rest."""
    values = dict(form.cleaned_data)
    made = running.add_cells(form.cells_chosen, actor=get_user(request))
    values["contestants"] = [*values["contestants"], *made]
    asked_for = read_request(running.JobRequest, values)
    if "try" in request.POST:
        plan = {
            name: str(value) if isinstance(value, Decimal) else value
            for name, value in read_values(
                to_inputs(running.JobRequest), form.cleaned_data
            ).items()
            if name != "contestants"
        }
        asked_for = replace(
            asked_for,
            name=f"{asked_for.name}, first try"[:LONGEST_NAME],
            scenarios=asked_for.scenarios[:1],
            samples=1,
            full_plan=plan,
        )
    return launch(asked_for, get_user(request))
