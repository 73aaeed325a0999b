"""What an admin does next, from an empty house to a rated table."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, cast

from django import forms
from django.contrib.auth.decorators import login_not_required
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse, JsonResponse, StreamingHttpResponse
from django.shortcuts import redirect, render
from django.utils.http import url_has_allowed_host_and_scheme
from django.views.decorators.http import require_POST, require_safe
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.exposition import CONTENT_TYPE_LATEST
from prometheus_client.registry import Collector

from arena.exports.audit import AUDIT_FORMATS
from arena.exports.formats import format_named
from arena.models import Study
from arena.queries import faults, inventory
from arena.queries.audit import MACHINE, AuditFilters, actors, acts, object_kinds, verbs
from arena.queries.gauges import read_gauges
from arena.queries.inventory import Inventory
from arena.queries.people import role_of
from arena.queries.studies import progress
from arena.queries.studies.results import ResultsAccess, results_access
from arena.services.preferences import choose_language, choose_theme
from arena.serving.metrics_key import opens_metrics
from arena.serving.readiness import look_at_parts
from arena.site.access import ADMIN, allow_only
from arena.site.forms import LanguageForm, ThemeForm
from arena.site.language import use_english
from arena.site.listing import choice_asked, read_page
from arena.web.people.sign_in import keep_language
from augment.errors import UnknownName
from augment.models import Event, GenerationJob
from augment.services.running.summary import count_each


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One step on the way; the first that is not done is the next one.

    Attributes:
        link: The name of the page where it is done, empty where it is done by a command.
    """

    title: str
    detail: str
    done: bool
    link: str
    action: str
    is_next: bool = False


def steps(found: Inventory) -> list[Step]:
    """The way through the house, with what is done and what comes next."""
    return _with_next([*_preparing(found), *_studying(found)])


def _preparing(found: Inventory) -> list[Step]:
    return [
        Step(
            title="Load the catalogue",
            detail=f"{found.scenarios} scenarios are here."
            if found.scenarios
            else "No scenario yet. What comes with the project is loaded by a button.",
            done=found.scenarios > 0,
            link="scenarios",
            action="Scenarios",
        ),
        Step(
            title="Have at least two contestants",
            detail=f"{found.contestants} contestants are registered."
            if found.contestants
            else "None yet. A model at an endpoint, or one of those that ask nobody.",
            done=found.contestants >= 2,
            link="contestants",
            action="Contestants",
        ),
        Step(
            title="Run a job",
            detail=f"{found.done} augmentations are done."
            if found.done
            else "A job lets contestants carry out the instructions of scenarios.",
            done=found.done > 0,
            link="job-new",
            action="New job",
        ),
    ]


def _studying(found: Inventory) -> list[Step]:
    return [
        Step(
            title="Open a study",
            detail=f"{found.studies} so far, {found.studies_open} open now."
            if found.studies
            else "Experts compare two results of a scenario without knowing whose they are.",
            done=found.studies > 0,
            link="studies",
            action="Studies",
        ),
        Step(
            title="Let the experts vote",
            detail=f"{found.votes:,} votes are saved; studies open: {found.studies_open}."
            if found.votes
            else "No vote yet.",
            done=found.votes > 0 and found.studies_open == 0,
            link="studies",
            action="Progress",
        ),
        Step(
            title="Close and read the results",
            detail=f"{found.studies_closed} closed."
            if found.studies_closed
            else "Results show once a study is closed.",
            done=found.studies_closed > 0,
            link="studies",
            action="Results",
        ),
    ]


def _with_next(way: list[Step]) -> list[Step]:
    """The same steps, the first open one marked."""
    position = next((n for n, step in enumerate(way) if not step.done), None)
    return [replace(step, is_next=n == position) for n, step in enumerate(way)]


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
        "labellings": faults.of_expert(expert),
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


ON_A_PAGE = 50


class DaysForm(forms.Form):
    """From when to when; what is no day filters nothing and is said."""

    since = forms.DateField(required=False)
    until = forms.DateField(required=False)


@allow_only(ADMIN)
@require_safe
def audit_page(request: HttpRequest) -> HttpResponse:
    """A page of acts, the newest first."""
    people, filters, days = _asked(request)
    page = read_page(request, acts(filters), size=ON_A_PAGE)
    context: dict[str, Any] = {
        "page": page,
        "lines": [(event, _details(event)) for event in page],
        "filters": filters,
        "days": days,
        "actors": people,
        "machine": MACHINE,
        "verbs": verbs(),
        "kinds": object_kinds(),
        "query": request.GET.urlencode(),
    }
    return render(request, "audit.html", context, status=422 if days.errors else 200)


@allow_only(ADMIN)
@require_safe
def audit_file(request: HttpRequest, form: str) -> StreamingHttpResponse:
    """All acts that the page's filters name, as a file that is sent while it is read."""
    try:
        chosen = format_named(AUDIT_FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    _, filters, days = _asked(request)
    if days.errors:
        raise Http404
    return StreamingHttpResponse(
        chosen.parts(acts(filters).iterator()),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="audit.{chosen.suffix}"'},
    )


def _details(event: Event) -> str:
    """What changed: before, an arrow, after; empty where the log keeps nothing of it."""
    kept = [one for one in (event.before, event.after) if one]
    return " → ".join(json.dumps(one, ensure_ascii=False) for one in kept)


def _asked(request: HttpRequest) -> tuple[list[Any], AuditFilters, DaysForm]:
    people = actors()
    days = DaysForm(request.GET)
    days.is_valid()
    codes = [MACHINE, *(str(one.person.code) for one in people)]
    filters = AuditFilters(
        actor=choice_asked(request, "actor", codes),
        verb=choice_asked(request, "verb", verbs()),
        object_kind=choice_asked(request, "kind", object_kinds()),
        object_code=request.GET.get("object", "").replace("\0", "").strip()[:120],
        since=days.cleaned_data.get("since"),
        until=days.cleaned_data.get("until"),
    )
    return people, filters, days


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
    """Numbers in the form of Prometheus, for an admin or who has the token of the settings."""
    if role_of(request.user) != ADMIN and not opens_metrics(request.headers.get("Authorization")):
        answer = HttpResponse("Send the token of ARENA_METRICS_TOKEN.\n", status=401)
        answer.headers["WWW-Authenticate"] = "Bearer"
        answer.headers["Content-Type"] = "text/plain; charset=utf-8"
        return answer
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Rows())
    return HttpResponse(generate_latest(registry), content_type=CONTENT_TYPE_LATEST)


class _Rows(Collector):
    """The gauges in the words of the client library."""

    def collect(self) -> Iterator[GaugeMetricFamily]:
        for gauge in read_gauges():
            family = GaugeMetricFamily(
                gauge.name, gauge.help, labels=[gauge.label] if gauge.label else None
            )
            for value, number in gauge.values:
                family.add_metric([value] if gauge.label else [], number)
            yield family
