"""A new job as it comes in by its form: cells of the matrix, contestants, scenarios, caps."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from decimal import Decimal
from functools import partial
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.db import transaction
from django.http import HttpRequest, HttpResponse
from django.shortcuts import redirect, render
from django.views.decorators.http import require_http_methods

from arena.jobs.pages.jobs import send_rows
from arena.scenarios import queries
from arena.web.access import ADMIN, allow_only
from arena.web.forms import CapsForm, ChoiceForm, Offer
from augment.errors import AugmentError
from augment.models import Contestant, EndpointModel, GenerationJob
from augment.services.endpoints.contestants import PROTOCOLS, REASONING_EFFORTS
from augment.services.endpoints.known_endpoints import is_key_here
from augment.services.running import jobs as service
from augment.services.running.choosing import find_obstacle, keys_missing
from augment.services.running.estimates import JobEstimate, estimate_rows
from augment.services.running.jobs import HIGHEST_SAMPLES
from augment.services.running.matrix import (
    ChosenCells,
    MatrixCell,
    add_cells,
    matrix_of,
    matrix_text,
    read_cells,
    read_matrix,
)

OF_CELLS = (
    *("temperature", "seed", "reasoning_effort", "max_output_tokens"),
    *("protocol", "rounds"),
)
"""Options that the page asks for; the others are for a contestant's own page and matrix files."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedCell:
    """A box of the matrix, or why it can't be ticked."""

    cell: MatrixCell
    obstacle: str
    is_chosen: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedRow:
    """A variant with all models."""

    label: str
    cells: tuple[OfferedCell, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixColumn:
    """A model at its endpoint."""

    known: EndpointModel
    key_missing: str


class LaunchForm(ChoiceForm, CapsForm):
    """A new job."""

    contestants = forms.MultipleChoiceField(required=False)
    cells = forms.MultipleChoiceField(required=False)
    samples = forms.IntegerField(min_value=1, max_value=HIGHEST_SAMPLES, initial=1, required=False)
    is_fresh = forms.BooleanField(required=False)
    temperature = forms.FloatField(required=False, label="Temperature")
    seed = forms.IntegerField(required=False, label="Seed")
    reasoning_effort = forms.ChoiceField(
        required=False,
        choices=[("", "–"), *((word, word) for word in REASONING_EFFORTS)],
        label="Reasoning effort",
    )
    max_output_tokens = forms.IntegerField(required=False, label="Tokens of one answer, at most")
    protocol = forms.ChoiceField(
        required=False,
        choices=[("", "–"), *((word, word) for word in PROTOCOLS)],
        label="Tool protocol",
    )
    rounds = forms.IntegerField(required=False, label="Rounds, at most")

    def __init__(self, *args: Any, models: list[EndpointModel], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.models = models
        self._matrix = matrix_of(models)
        keys = [cell.key for row in self._matrix for cell, why_not in row.cells if not why_not]
        self._offer("cells", [(key, key) for key in keys])

    def clean_samples(self) -> int:
        """An empty field is one sample."""
        return self.cleaned_data["samples"] or 1

    def clean(self) -> dict[str, Any]:
        """Somebody is chosen, by name or by a cell; options are what they may be."""
        cleaned = super().clean()
        if not (cleaned.get("contestants") or cleaned.get("cells")):
            self.add_error("contestants", "Choose at least one contestant.")
        options = {name: v for name in OF_CELLS if (v := cleaned.get(name)) not in (None, "")}
        try:
            cleaned["chosen_cells"] = read_cells(cleaned.get("cells", []), options)
        except AugmentError as error:
            self.add_error(None, str(error))
        return cleaned

    @property
    def offers(self) -> list[Offer]:
        """Contestants that no job can run say why."""
        return [_offer(row) for row in self.offered]

    @property
    def columns(self) -> list[MatrixColumn]:
        """For the template: the models, and whether their keys are here."""
        return [
            MatrixColumn(known=known, key_missing="" if is_key_here(name) or not name else name)
            for known in self.models
            for name in [known.endpoint.key_variable]
        ]

    @property
    def matrix(self) -> list[OfferedRow]:
        """For the template: variants down, models across."""
        chosen = set(self.chosen("cells"))
        return [
            OfferedRow(
                label=row.label,
                cells=tuple(
                    OfferedCell(cell=cell, obstacle=why_not, is_chosen=cell.key in chosen)
                    for cell, why_not in row.cells
                ),
            )
            for row in self._matrix
        ]

    @property
    def option_fields(self) -> list[forms.BoundField]:
        """For the template."""
        return [self[name] for name in OF_CELLS]

    @property
    def has_options(self) -> bool:
        """For the template: whether any is filled in, so that one sees which."""
        return any(self[name].value() not in (None, "") for name in OF_CELLS)

    def chosen_cells_value(self) -> ChosenCells:
        """The cells with their options, once the form is valid."""
        found = self.cleaned_data.get("chosen_cells")
        return found if isinstance(found, ChosenCells) else ChosenCells()

    def chosen_rows(self) -> list[Contestant]:
        """Whoever is chosen, each once; those of cells may not be stored yet."""
        named = Contestant.objects.filter(slug__in=self.cleaned_data.get("contestants", []))
        found = [*named.select_related("endpoint"), *self.chosen_cells_value().contestants()]
        return list({row.slug: row for row in found}.values())

    def estimated(self) -> JobEstimate | None:
        """What the job would use, as far as it is chosen; nothing has to be named or capped."""
        self.is_valid()
        for name in ("name", "contestants", "scenarios"):
            self.errors.pop(name, None)
        who, scenarios = self.chosen_rows(), self.cleaned_data.get("scenarios", [])
        if not (who and scenarios):
            return None
        return estimate_rows(
            who,
            scenarios,
            samples=self.cleaned_data.get("samples", 1),
            is_fresh=self.cleaned_data.get("is_fresh", False),
        )


# --- Private -----------------------------------------------------------------------------------


def _offer(row: Contestant) -> Offer:
    why_not = find_obstacle(row)
    missing = () if why_not else tuple(keys_missing(row))
    return Offer(row=row, obstacle=why_not, keys_missing=missing)


LONGEST_FILE = 1_000_000
LONGEST_NAME = 120


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_job_page(request: HttpRequest) -> HttpResponse:
    """Choose contestants and scenarios, then launch."""
    if "read" in request.POST:
        return _read(request)
    form = _form(request, request.POST or None, initial=_like(request))
    if "matrix" in request.POST:
        return _matrix(request, form)
    if "estimate" in request.POST:
        return _estimated(request, form)
    if request.method == "POST" and form.is_valid():
        try:
            job = _launch(request, form)
        except AugmentError as error:
            form.add_error(None, str(error))
        else:
            messages.success(request, f"“{job.name}” is launched.")
            return redirect("job", code=job.code)
    return _page(request, form, status=422 if form.errors else 200)


# --- Private -----------------------------------------------------------------------------------


def _form(request: HttpRequest, data: Any, *, initial: dict[str, Any] | None = None) -> LaunchForm:
    return LaunchForm(
        data,
        initial=initial,
        contestants=list(
            Contestant.objects.filter(retired_at=None).select_related("endpoint").order_by("name")
        ),
        groups=queries.by_type(queries.set_asked(request.GET.get("set"))),
        models=list(
            EndpointModel.objects.select_related("endpoint").order_by("endpoint__label", "model")
        ),
    )


def _page(
    request: HttpRequest, form: LaunchForm, *, status: int = 200, **more: object
) -> HttpResponse:
    chosen_set = queries.set_asked(request.GET.get("set"))
    context = {"form": form, "sets": queries.set_choices(chosen_set), **more}
    return render(request, "jobs/new.html", context, status=status)


def _like(request: HttpRequest) -> dict[str, Any]:
    """What the form is filled with: another job where the address names one, else nothing."""
    try:
        code = uuid.UUID(request.GET.get("like", ""))
    except ValueError:
        return {}
    job = GenerationJob.objects.filter(code=code).first()
    if job is None:
        return {}
    caps = {"cap_usd": job.cap_usd, "cap_calls": job.cap_calls, "cap_tokens": job.cap_tokens}
    found: dict[str, Any] = {
        "name": f"{job.name} (2)"[:LONGEST_NAME],
        "contestants": list(job.contestants.values_list("slug", flat=True)),
        "scenarios": list(job.scenarios.values_list("slug", flat=True)),
        "samples": job.samples,
        "is_fresh": job.is_fresh,
        **{name: value for name, value in caps.items() if value is not None},
    }
    if found.get("cap_usd") is not None:
        found["cap_usd"] = f"{found['cap_usd'].normalize():f}"
    plan = job.full_plan
    return found | plan if plan is not None and request.GET.get("all") == "1" else found


def _estimated(request: HttpRequest, form: LaunchForm) -> HttpResponse:
    """The page as it came in, with what the job would use; nothing is launched."""
    more: dict[str, Any] = {}
    try:
        found = form.estimated()
    except AugmentError as error:
        form.add_error(None, str(error))
    else:
        cap = form.cleaned_data.get("cap_usd")
        more |= {"estimate": found, "cap_usd": cap}
        if found is not None and cap is not None:
            more["rows_within"] = found.rows_within(cap)
    return _page(request, form, **more)


def _matrix(request: HttpRequest, form: LaunchForm) -> HttpResponse:
    """What is chosen as a file for `generate --matrix`; a name is not needed for it."""
    form.is_valid()
    form.errors.pop("name", None)
    if form.errors:
        return _page(request, form, status=422)
    text = matrix_text(
        form.chosen_rows(),
        form.cleaned_data["scenarios"],
        samples=form.cleaned_data["samples"],
        name=form.cleaned_data.get("name", ""),
    )
    return HttpResponse(
        text,
        content_type="application/yaml; charset=utf-8",
        headers={"Content-Disposition": 'attachment; filename="matrix.yaml"'},
    )


def _read(request: HttpRequest) -> HttpResponse:
    """The form filled in from a matrix file; contestants that it has in full are made."""
    file = request.FILES.get("file")
    problem = ""
    if file is None:
        problem = "Choose a matrix file."
    elif file.size is None or file.size > LONGEST_FILE:
        problem = "The file is too long for a matrix: at most 1 MB."
    else:
        try:
            found = read_matrix(file.read().decode(), actor=cast(User, request.user))
        except UnicodeDecodeError:
            problem = "The file is not UTF-8."
        except AugmentError as error:
            problem = str(error)
    if problem:
        return _page(request, _form(request, None), status=422, file_problem=problem)
    for slug in found.made:
        messages.success(request, f"“{slug}” is added.")
    initial = {
        "name": found.name or "",
        "contestants": list(found.contestants),
        "scenarios": list(found.scenarios),
        "samples": found.samples,
    }
    return _page(request, _form(request, None, initial=initial))


def _launch(request: HttpRequest, form: LaunchForm) -> GenerationJob:
    """The job; of one that tries first, one scenario with a memory of the rest."""
    actor, chosen = cast(User, request.user), form.cleaned_data
    where, samples, name, plan = chosen["scenarios"], chosen["samples"], chosen["name"], None
    if "try" in request.POST:
        plan = _plan(form)
        where, samples = where[:1], 1
        name = f"{name}, first try"
    with transaction.atomic():
        made = add_cells(form.chosen_cells_value(), actor=actor)
        job = service.launch(
            name=name[:LONGEST_NAME],
            contestants=list(dict.fromkeys([*chosen["contestants"], *made])),
            scenarios=where,
            caps=form.caps(),
            samples=samples,
            is_fresh=chosen["is_fresh"],
            full_plan=plan,
            actor=actor,
        )
        transaction.on_commit(partial(send_rows, request, job.pk))
    return job


def _plan(form: LaunchForm) -> dict[str, Any]:
    """What was chosen for the whole job, as the form's fields have it."""
    names = ("name", "scenarios", "samples", "is_fresh", "cap_usd", "cap_calls", "cap_tokens")
    chosen = {name: form.cleaned_data.get(name) for name in names}
    return {
        name: str(value) if isinstance(value, Decimal) else value
        for name, value in chosen.items()
        if value is not None
    }
