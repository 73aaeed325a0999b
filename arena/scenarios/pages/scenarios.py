"""Pages of the catalogue: scenarios with their intents; retiring and deleting."""

import uuid
from typing import Any

from django.contrib import messages
from django.http import Http404, HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse

from arena.scenarios import queries, services
from arena.shell import acts
from arena.shell.access import ADMIN, STAFF, act_for, form_for, get_user, page_for
from arena.shell.forms import read_json
from arena.shell.listing import read_listing, read_page
from augment.errors import Conflict, InvalidDocument
from augment.models import BaseScene, EndpointModel, Scenario
from augment.services import benchmarks, endpoints, read_code, retire, running, scenarios
from augment.services.scenarios import bulk

SCENARIOS_AT_ONCE = 16
LONGEST_FILE = 200_000
JSON_STYLE = {"indent": 2, "ensure_ascii": False}


@page_for(*STAFF)
def scenarios_page(request: HttpRequest) -> HttpResponse:
    """List scenarios of a set by type, with the reference where it was drawn."""
    chosen = queries.set_asked(request.GET.get("set"))
    choices = {
        "type": ("Type", scenarios.type_choices()),
        "offered": ("In forms", [("retired", "retired")]),
    }
    listing = read_listing(request, choices, keep=("set",))
    listed = queries.list_scenarios(chosen, is_retired=bool(listing.find_choice("offered")))
    listed = listed.filter(paraphrase_of=None)
    listed = listing.narrow(listed, "slug", "instruction", "base_scene__slug", by=["type"])
    page = read_page(request, listed, size=SCENARIOS_AT_ONCE)
    rows = list(page.object_list)
    context = {
        "groups": queries.group_by_type(rows),
        "sets": queries.set_choices(chosen),
        "references": queries.reference_pictures(rows),
        "page": page,
        "listing": listing,
    }
    return render(request, "scenarios/list.html", context)


@act_for(ADMIN, back="scenarios")
def load_scenarios(request: HttpRequest) -> None:
    """Load one set of the catalogue, all of it or nothing, and the built-in contestants."""
    report = scenarios.load_catalogue(
        sets=[request.POST.get("set", "")],
        with_paraphrases="wordings" in request.POST,
        actor=get_user(request),
    )
    endpoints.ensure_builtin()
    counts = ", ".join(f"{number} {step.value}" for step, number in report.scenarios.items())
    messages.success(request, f"Scenarios: {counts}.")


@page_for(*STAFF)
def scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one scenario: before and after the reference, and every other result."""
    rows = Scenario.objects.select_related("base_scene", "paraphrase_of", "follows")
    scenario = get_object_or_404(rows, code=code)
    reading, reference = scenarios.waiting_reading(scenario), scenarios.reference_picture(scenario)
    has_picture = scenarios.is_drawn(reference)
    is_waiting = not scenario.original_image or (
        scenario.reference is not None and not has_picture
    )
    if is_waiting and not acts.looks_again(request):
        acts.send_later(request, scenario)
    readers = EndpointModel.objects.select_related("endpoint")
    last = scenarios.last_reading(scenario)
    is_reading = last is not None and last.state in last.UNDER_WAY
    context = {
        "scenario": scenario,
        "paraphrases": scenario.paraphrases.all(),
        "follow_ups": scenario.follow_ups.filter(retired_at=None),
        "has_picture": has_picture,
        "reference_name": reference,
        **acts.wait_for_workers(waits=is_waiting or is_reading),
        "why_not_editable": services.why_not_editable(scenario),
        "lines": queries.modification_lines(scenario.reference),
        "statements": scenarios.intent_statements(scenario.intent),
        "reading": reading,
        "reading_statements": scenarios.intent_statements(
            None if reading is None else reading.document
        ),
        "last_reading": last,
        "readers": readers.order_by("endpoint__label", "model"),
        "notes": scenarios.note_sentences(scenario.base_scene.notes),
        "augmentations": queries.list_augmentations(scenario),
    }
    return render(request, "scenarios/scenario.html", context)


@form_for(*STAFF)
def bulk_page(request: HttpRequest) -> HttpResponse:
    """Add many scenarios from a CSV or YAML file, all or none."""
    problems, most = list[tuple[str, str]](), bulk.MOST_ROWS_AT_ONCE
    if request.method == "POST":
        table = request.FILES.get("file")
        try:
            if table is None or services.was_too_large(request.META):
                raise InvalidDocument("file", [("", "choose CSV or YAML; it may be too large")])
            slugs = bulk.add_rows(
                table.name or "", table.read(), most=most, actor=get_user(request)
            )
            messages.success(request, f"{len(slugs)} scenarios are added.")
            return redirect("scenarios")
        except InvalidDocument as error:
            problems = [(path, str(text)) for path, text in error.problems]
    return render(request, "scenarios/bulk.html", {"problems": problems, "most": most})


# --- Intents -----------------------------------------------------------------------------------


@page_for(*STAFF)
def intent_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Answer with the intent as its JSON document, to be edited and sent back."""
    scenario = get_object_or_404(Scenario, code=code)
    if scenario.intent is None:
        raise Http404
    answer = JsonResponse(scenario.intent, json_dumps_params=JSON_STYLE)
    answer["Content-Disposition"] = f'attachment; filename="intent-{scenario.slug}.json"'
    return answer


@act_for(*STAFF, back="scenario")
def set_intent(request: HttpRequest, code: uuid.UUID) -> None:
    """Accept the last reading, or take the intent of the file that came along."""
    scenario = get_object_or_404(Scenario, code=code)
    benchmarks.refuse_handed_out(scenario.slug, [benchmarks.Split.PRACTICE])
    if "accept" in request.POST:
        scenarios.accept_reading(scenario=scenario.slug, actor=get_user(request))
    else:
        file = request.FILES.get("file")
        if file is None or not file.size or file.size > LONGEST_FILE:
            raise Conflict("Choose a JSON file; it may be too long for an intent.")
        document = read_json(file.read(), otherwise="The file is no JSON.")
        scenarios.enter_intent(scenario=scenario.slug, document=document, actor=get_user(request))
    messages.success(request, "The intent is set. It counts from now on.")


@act_for(ADMIN, back="scenario")
def read_instruction(request: HttpRequest, code: uuid.UUID) -> None:
    """Have a worker ask a model to read the instruction; what it read waits on the page."""
    scenario = get_object_or_404(Scenario, code=code)
    models = EndpointModel.objects.select_related("endpoint")
    reader = models.filter(code=read_code(request.POST.get("reader", ""))).first()
    if reader is None:
        raise Conflict("Choose a model.")
    reading = running.plan_reading(
        scenario=scenario, endpoint=reader.endpoint, model=reader.model, actor=get_user(request)
    )
    acts.send_later(request, reading)
    messages.success(request, f"{reader.model} reads it now.")


# --- Retiring and deleting ---------------------------------------------------------------------


@form_for(ADMIN)
def delete(request: HttpRequest, code: uuid.UUID, kind: str) -> HttpResponse:
    """Delete a scenario or scene that nothing depends on, once that is confirmed."""
    row: Any = get_object_or_404(Scenario if kind == "scenario" else BaseScene, code=code)
    if not acts.is_sure(request):
        facts = ("Only what no job, study or scenario needs is deleted. There is no way back.",)
        question = acts.Confirmation(
            title=f"Delete “{row.slug}”?",
            facts=facts,
            button="Delete",
            back=reverse(kind, args=[code]),
        )
        return acts.ask(request, question)
    with acts.refusals_told(request):
        services.delete(row, actor=get_user(request))
        messages.success(request, f"“{row.slug}” is deleted.")
        return redirect(f"{kind}s")
    return redirect(kind, code=code)


@act_for(ADMIN, back="scenario")
def set_retired(request: HttpRequest, code: uuid.UUID) -> None:
    """Retire a scenario, or take that back."""
    row = get_object_or_404(Scenario, code=code)
    retire(row, actor=get_user(request), is_retired=request.POST.get("retired") != "no")
