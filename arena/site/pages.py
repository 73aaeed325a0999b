"""Home of each role with its first steps, the audit log, and what monitoring asks."""

import json
from collections.abc import Iterator
from typing import Any

from django import forms
from django.contrib.auth.decorators import login_not_required
from django.http import Http404, HttpRequest, HttpResponse, JsonResponse, StreamingHttpResponse
from django.shortcuts import redirect, render
from django.utils.http import url_has_allowed_host_and_scheme
from django.views.decorators.http import require_POST, require_safe
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_LATEST
from prometheus_client.registry import Collector

from arena.exports.formats import format_named
from arena.jobs import queries
from arena.models import Study
from arena.people.pages import keep_language
from arena.people.queries import Language, Theme, role_of
from arena.people.services import keep_preference
from arena.results.queries.access import ResultsAccess, results_access
from arena.serving.readiness import look_at_parts, opens_metrics
from arena.site.access import ADMIN, allow_only, user_of
from arena.site.exports import AUDIT_FORMATS
from arena.site.forms import offer
from arena.site.language import use_english
from arena.site.listing import read_page
from arena.site.queries import MACHINE, actors, acts, distinct, read_gauges, take_inventory
from arena.studies import queries as studies
from arena.templatetags.results import label_of
from augment.errors import UnknownName
from augment.models import Event, GenerationJob
from augment.services.running.progress import count_each

LATEST_JOBS = 5
ACTS_AT_ONCE = 50

# --- Home --------------------------------------------------------------------------------------


@require_safe
def home(request: HttpRequest) -> HttpResponse:
    """Show the page of the role that somebody has."""
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


def _expert(request: HttpRequest) -> HttpResponse:
    expert = user_of(request)
    lines = studies.progress_of(studies.listed_studies(expert), expert)
    closed = [line for line in lines if line.study.state == Study.State.CLOSED]
    is_open = [line for line in lines if line.study.state == Study.State.OPEN]
    context = {
        "to_do": [line for line in is_open if line.left],
        "finished": [line for line in is_open if not line.left],
        "closed": closed,
        "cancelled": [line for line in lines if line.study.state == Study.State.CANCELLED],
        "labellings": queries.of_expert(expert),
        "readable": {
            line.study.pk: results_access(user=expert, study=line.study) is ResultsAccess.FULL
            for line in closed
        },
    }
    return render(request, "home/expert.html", context)


def _analyst(request: HttpRequest) -> HttpResponse:
    lines = studies.progress_of(studies.listed_studies())
    context = {
        "running": [line for line in lines if line.study.state == Study.State.OPEN],
        "closed": [line for line in lines if line.study.state == Study.State.CLOSED],
    }
    return render(request, "home/analyst.html", context)


def _admin(request: HttpRequest) -> HttpResponse:
    inventory = take_inventory()
    context = {
        "inventory": inventory,
        "steps": list_steps(inventory),
        "jobs": count_each(list(GenerationJob.objects.all()[:LATEST_JOBS])),
        "running": studies.progress_of(studies.listed_studies().filter(state=Study.State.OPEN)),
    }
    return render(request, "home/admin.html", context)


STEPS = (
    (
        *("Load the catalogue", "scenarios", "Scenarios", "{scenarios} scenarios are here."),
        "No scenario yet. What comes with the project is loaded by a button.",
    ),
    (
        *("Have at least two contestants", "contestants", "Contestants"),
        "{contestants} contestants are registered.",
        "None yet. A model at an endpoint, or one of those that ask nobody.",
    ),
    (
        *("Run a job", "job-new", "New job", "{done} augmentations are done."),
        "A job lets contestants carry out the instructions of scenarios.",
    ),
    (
        *("Open a study", "studies", "Studies", "{studies} so far, {studies_open} open now."),
        "Experts compare two results of a scenario without knowing whose they are.",
    ),
    (
        *("Let the experts vote", "studies", "Progress"),
        "{votes:,} votes are saved; studies open: {studies_open}.",
        "No vote yet.",
    ),
    (
        *("Close and read the results", "studies", "Results", "{studies_closed} closed."),
        "Results show once a study is closed.",
    ),
)
"""From an empty installation to a rated table: a title, the page where it is done and its
button, and what is said once there is something and before."""


def list_steps(counts: dict[str, int]) -> list[dict[str, Any]]:
    """Return the first steps of an admin, with what is done and what comes next."""
    begun = ("scenarios", "contestants", "done", "studies", "votes", "studies_closed")
    done = [counts[name] > 0 for name in begun]
    done[1] = counts["contestants"] >= 2
    done[4] = done[4] and counts["studies_open"] == 0
    following = done.index(False) if False in done else None
    return [
        {
            "title": title,
            "link": link,
            "action": action,
            "detail": there.format(**counts) if counts[begun[n]] else before,
            "done": done[n],
            "is_next": n == following,
        }
        for n, (title, link, action, there, before) in enumerate(STEPS)
    ]


@require_POST
def theme(request: HttpRequest) -> HttpResponse:
    """Keep how the pages look, then go back to where the switch was pressed."""
    chosen = request.POST.get("theme")
    if chosen in set(Theme):
        keep_preference(user_of(request), theme=chosen)
    return _back(request)


@require_POST
def language(request: HttpRequest) -> HttpResponse:
    """Keep the language with the account, and in this browser for the pages before the login."""
    chosen, answer = request.POST.get("language"), _back(request)
    if chosen in set(Language):
        keep_preference(user_of(request), language=chosen)
        keep_language(answer, Language(chosen))
    return answer


def _back(request: HttpRequest) -> HttpResponse:
    """Return to where the switch was pressed, if that is a page of ours."""
    back = request.POST.get("next", "")
    is_ours = url_has_allowed_host_and_scheme(back, {request.get_host()}, request.is_secure())
    return redirect(back if is_ours and "/" in back else "home")  # else it names a view


# --- The audit log -----------------------------------------------------------------------------


class AuditForm(forms.Form):
    """Which acts the log shows; what is empty filters nothing."""

    actor = forms.ChoiceField(required=False, label="By")
    verb = forms.ChoiceField(required=False, label="What")
    kind = forms.ChoiceField(required=False, label="To")
    object = forms.CharField(
        required=False, max_length=120, label="Code, or name of a study", strip=True
    )
    since = forms.DateField(required=False, label="From", widget=forms.DateInput())
    until = forms.DateField(required=False, label="To and with", widget=forms.DateInput())

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        people = [(str(user.person.code), user.person.pseudonym) for user in actors()]
        offered = {
            "actor": [("", "anybody"), (MACHINE, "the machine"), *people],
            "verb": [
                ("", "anything"),
                *((verb, label_of("verb_label", verb)) for verb in distinct("verb")),
            ],
            "kind": [("", "anything"), *((kind, kind) for kind in distinct("object_kind"))],
        }
        for name, choices in offered.items():
            offer(self, name, choices)
        for name in ("since", "until"):
            self.fields[name].widget.input_type = "date"


@allow_only(ADMIN)
@require_safe
def audit_page(request: HttpRequest) -> HttpResponse:
    """A page of acts, the newest first."""
    form = AuditForm(request.GET)
    is_valid = form.is_valid()
    page = read_page(request, acts(form.cleaned_data), size=ACTS_AT_ONCE)
    context = {
        "page": page,
        "lines": [(event, _details(event)) for event in page],
        "form": form,
        "query": request.GET.urlencode(),
    }
    return render(request, "audit.html", context, status=200 if is_valid else 422)


@allow_only(ADMIN)
@require_safe
def audit_file(request: HttpRequest, form: str) -> StreamingHttpResponse:
    """All acts that the page's filters name, as a file that is sent while it is read."""
    asked = AuditForm(request.GET)
    try:
        chosen = format_named(AUDIT_FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    if not asked.is_valid():
        raise Http404
    return StreamingHttpResponse(
        chosen.parts(acts(asked.cleaned_data).iterator()),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="audit.{chosen.suffix}"'},
    )


def _details(event: Event) -> str:
    """Return what changed: before, an arrow, after."""
    kept = [change for change in (event.before, event.after) if change]
    return " → ".join(json.dumps(change, ensure_ascii=False) for change in kept)


# --- Monitoring --------------------------------------------------------------------------------


@login_not_required
@require_safe
def healthz(request: HttpRequest) -> HttpResponse:
    """200 while this process answers at all; a container that does not is started again."""
    return JsonResponse({"status": "ok"})


@login_not_required
@require_safe
def readyz(request: HttpRequest) -> HttpResponse:
    """Return 200 if the database, the broker and at least one worker are working, else 503.

    The body names the state of each part. Voting needs the database alone: a load balancer that
    is to keep it up without workers asks `healthz`.
    """
    parts = look_at_parts()
    is_ready = all(part.is_ok for part in parts)
    document = {
        "status": "ok" if is_ready else "down",
        "parts": {part.name: part.state for part in parts},
    }
    return JsonResponse(document, status=200 if is_ready else 503)


@login_not_required
@require_safe
def metrics(request: HttpRequest) -> HttpResponse:
    """Numbers in Prometheus's format, for an admin or who has the token of the settings."""
    if role_of(request.user) != ADMIN and not opens_metrics(request.headers.get("Authorization")):
        return HttpResponse(
            "Send the token of ARENA_METRICS_TOKEN.\n",
            status=401,
            content_type="text/plain; charset=utf-8",
            headers={"WWW-Authenticate": "Bearer"},
        )
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Gauges())
    return HttpResponse(generate_latest(registry), content_type=CONTENT_TYPE_LATEST)


class _Gauges(Collector):
    def collect(self) -> Iterator[Any]:
        yield from read_gauges()
