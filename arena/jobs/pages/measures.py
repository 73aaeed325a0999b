"""Pages of a job's measures: drives, displacement, analyses, and its files."""

import uuid
from functools import partial
from typing import Any

from django.contrib import messages
from django.db import transaction
from django.http import (
    FileResponse,
    Http404,
    HttpRequest,
    HttpResponse,
    HttpResponseBase,
    StreamingHttpResponse,
)
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import slugify
from django.views.decorators.http import require_POST

from arena.exports.formats import TABLE_FORMATS, download
from arena.jobs.exports import displacement, driving
from arena.jobs.exports.files import TRANSCRIPT_FORMATS, transcript_lines
from arena.jobs.exports.tables import JOB_FILES
from arena.jobs.queries import find_unmodified_drive
from arena.jobs.services import ask_for_file
from arena.models import ScenarioFile
from arena.shell.access import ADMIN, STAFF, allow_only, get_user, page_for
from arena.shell.acts import looks_again, refusals_told, send_later
from arena.shell.listing import choice_asked, read_page
from arena.shell.pictures import charts_for_pages, file_response
from augment.errors import Conflict
from augment.models import GenerationJob, Simulation
from augment.services.driving import NUPLAN, compare_job, drive_file, driving_scores, simulations
from augment.services.driving.simulations import SCORES, Options
from augment.services.judging import count_unmeasured, read_answers
from augment.services.judging.analyses import ANALYSES, SEED
from augment.services.judging.displacement import By
from augment.services.judging.scenario_export import FORMATS
from augment.tasks import enqueue_measure, enqueue_simulations

PDM_CLOSED = Options().planner
OFFSETS = {"paper": "Up to 4 m (paper)", "original": "Up to 1 m (original)"}
"""What the names of the lateral offsets mean."""

DRIVES_AT_ONCE = 50
PLANNERS = {PDM_CLOSED: "PDM-Closed", "idm": "IDM"}


@allow_only(ADMIN)
@require_POST
def simulate_job(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have the job's results driven by the workers."""
    job = get_object_or_404(GenerationJob, code=code)
    planner = request.POST.get("planner", PDM_CLOSED)
    options = Options(
        planner=planner,
        offsets=request.POST.get("offsets", "paper") if planner == PDM_CLOSED else "paper",
        is_reactive=request.POST.get("reactive") == "on",
    )
    with refusals_told(request), transaction.atomic():
        waiting = simulations.plan_job(job=job, options=options)
        send_later(request, job, partial(enqueue_simulations, waiting))
        drives = "drive is" if len(waiting) == 1 else "drives are"
        messages.success(request, f"{len(waiting)} {drives} queued.")
    return redirect("job-tab", code=code, tab="driving")


@page_for(*STAFF)
def drives_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """List the drives of a job that were made one way, page by page."""
    job = get_object_or_404(GenerationJob, code=code)
    ways, way = _ways(request, job)
    drives = Simulation.objects.filter(driving_scores.drives_of_job(job)).defer("trace")
    rows = ways[way].of(drives).select_related("scenario", "augmentation__contestant")
    order = "scenario__type", "scenario__slug", "augmentation__contestant__name"
    page = read_page(request, rows.order_by(*order), size=DRIVES_AT_ONCE)
    lines = [(row, driving_scores.least_clearance_m(row)) for row in page.object_list]
    return render(request, "drives/list.html", {"job": job, "page": page, "lines": lines})


@page_for(*STAFF)
def drive_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one drive, beside the same scene before the change."""
    row = _driven(code)
    before = find_unmodified_drive(row)
    metrics, old = _metrics(row), {score["name"]: score["value"] for score in _metrics(before)}
    context = {
        "drive": row,
        "before": before,
        "metrics": [metric | {"before": old.get(metric["name"])} for metric in metrics],
    }
    return render(request, "drives/drive.html", context)


@page_for(*STAFF)
def drive_trace(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Answer with the drive as JSON, which the page draws and anybody may save."""
    row = _driven(code)
    if row.state != Simulation.State.DONE:
        raise Http404
    headers = {"Cache-Control": "private, max-age=3600"}
    return HttpResponse(drive_file(row), content_type="application/json", headers=headers)


def driving_section(request: HttpRequest, job: GenerationJob) -> dict[str, object]:
    """Return the context of the driving part of a job's page."""
    driven, chosen = _ways(request, job)
    score = choice_asked(request, "score", list(SCORES)) or NUPLAN
    table = driving_scores.scores_of_job(job, options=driven[chosen], score=score)
    ways = []
    for way in driven:
        planner = PLANNERS.get(way.planner, way.planner)
        offsets = OFFSETS[way.offsets] if way.planner == PDM_CLOSED else ""
        version = f"version {way.version}" if way.version != Options().version else ""
        words = (planner, offsets, "reactive" if way.is_reactive else "", version)
        ways.append(" · ".join(filter(None, words)))
    try:
        planners = driving.planner_context(compare_job(job, score=score))
    except Conflict:
        planners = None
    return {
        **driving.driving_context(table),
        "planners": planners,
        "planner_forms": driving.PLANNER_FORMATS,
        "forms": driving.FORMATS,
        "ways": ways,
        "driven": chosen,
        "choices": {"planner": PLANNERS.items(), "offsets": OFFSETS.items()},
        "asked": table.options,
    }


def _ways(request: HttpRequest, job: GenerationJob) -> tuple[list[Options], int]:
    """Return how the job was driven, the last way first, and which the address asks for."""
    drives = driving_scores.drives_of_job(job)
    ways = driving_scores.options_driven(drives) or [Options()]
    numbers = [str(number) for number in range(len(ways))]
    return ways, int(choice_asked(request, "driven", numbers) or 0)


def _driven(code: uuid.UUID) -> Simulation:
    related = "scenario", "augmentation__contestant", "swept__sweep"
    return get_object_or_404(Simulation.objects.select_related(*related), code=code)


def _metrics(row: Simulation | None) -> list[dict[str, Any]]:
    """Return the parts of nuPlan's score."""
    return [] if row is None or row.document is None else row.document["metrics"][NUPLAN]


# --- Displacement, analyses and files -----------------------------------------------------------

UNMEASURED_FILES = (
    "faults",
    "tool-calls",
    "transcripts",
    *(f"{table}-{score}" for table in ("driving", "planners") for score in SCORES),
)
"""Files of a job that need no measure of its rows."""

GROUPINGS = {By.CONTESTANT: "Contestant", By.TYPE: "Scenario type", By.VARIANT: "Variant"}


@page_for(*STAFF)
@charts_for_pages
def export_table(request: HttpRequest, code: uuid.UUID, name: str, form: str) -> HttpResponseBase:
    """Answer with a table as a file, with the options that its part of the page has."""
    job = get_object_or_404(GenerationJob, code=code)
    if name not in JOB_FILES:
        raise Http404
    if name not in UNMEASURED_FILES and ask_to_measure(request, job):
        messages.info(request, "Its rows are being measured; the file is offered afterwards.")
        return redirect("job-tab", code=code, tab="displacement")
    options: dict[str, Any] = {}
    if name.startswith("driving-"):
        ways, way = _ways(request, job)
        options = {"options": ways[way]}
    stem = f"{slugify(job.name) or 'job'}-{name}"
    with refusals_told(request):  # planners of which only one drove, for example
        return download(JOB_FILES[name].formats, form, stem, JOB_FILES[name].make(job, **options))
    return redirect("job-tab", code=code, tab="driving")


@page_for(*STAFF)
def export_transcripts(request: HttpRequest, code: uuid.UUID) -> StreamingHttpResponse:
    """Answer with a line of JSON for each augmentation, sent while the rest is read."""
    job = get_object_or_404(GenerationJob, code=code)
    name = f"{slugify(job.name) or 'job'}-transcripts.jsonl"
    return StreamingHttpResponse(
        transcript_lines(job),
        content_type=TRANSCRIPT_FORMATS["jsonl"].content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@page_for(*STAFF)
def analyses_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show all three parts, on a page of their own: the bootstrap may take seconds."""
    job = get_object_or_404(GenerationJob, code=code)
    if ask_to_measure(request, job):
        return redirect("job-tab", code=code, tab="displacement")
    answers = read_answers(job)
    parts = {part: analyse(answers) for part, analyse in ANALYSES.items()}
    has_wishes = any(entry.wish for measured in answers.values() for entry in measured)
    context = {"job": job, "seed": SEED, "forms": list(TABLE_FORMATS), "has_wishes": has_wishes}
    context |= parts
    context["who"] = {slug: rows[0].row.contestant for slug, rows in answers.items()}
    return render(request, "jobs/analyses.html", context)


@allow_only(*STAFF)
@require_POST
def ask_for_scenarios(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """Leave a zip of all scenarios of a job to a worker; twice does no harm."""
    job = get_object_or_404(GenerationJob, code=code)
    if form not in FORMATS:
        raise Http404
    with refusals_told(request), transaction.atomic():
        row = ask_for_file(job=job, file_format=form, actor=get_user(request))
        send_later(request, row)
        messages.success(request, "A worker writes the file; it is offered here when ready.")
    return redirect("job-tab", code=code, tab="files")


@page_for(*STAFF)
def download_scenarios(request: HttpRequest, code: uuid.UUID) -> FileResponse:
    """Answer with a zip that is ready."""
    row = get_object_or_404(ScenarioFile, code=code, state=ScenarioFile.State.READY)
    return file_response(row)


def ask_to_measure(request: HttpRequest, job: GenerationJob) -> int:
    """Return how many rows are still to be measured, and leave them to a worker."""
    unmeasured = count_unmeasured(job)
    if unmeasured and not looks_again(request):
        send_later(request, job, partial(enqueue_measure, job.pk))
    return unmeasured


def displacement_section(request: HttpRequest, job: GenerationJob) -> dict[str, object]:
    """Return the context of the displacement part of a job's page: by contestant unless asked."""
    by = By(choice_asked(request, "by", list(By)) or By.CONTESTANT)
    return {
        "table": displacement.displacement_table(job, by=by),
        "by": by,
        "labels": GROUPINGS,
        "forms": displacement.FORMATS,
        "object_forms": TABLE_FORMATS,
        "name": f"displacement-by-{by}",
    }
