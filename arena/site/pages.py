"""Home of each role with its first steps, the audit log, and what monitoring asks."""

from collections.abc import Iterator
from typing import Any

from django.contrib.auth.decorators import login_not_required
from django.contrib.auth.models import User
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import redirect, render
from django.utils.http import url_has_allowed_host_and_scheme
from django.views.decorators.http import require_POST, require_safe
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_LATEST
from prometheus_client.registry import Collector

from arena.jobs import queries
from arena.models import Person, Study
from arena.people.pages import keep_language
from arena.people.services import keep_preference
from arena.scenarios.queries import count_waiting, submissions_for
from arena.serving.readiness import look_at_parts, opens_metrics
from arena.shell.access import ADMIN, act_for, get_user, page_for
from arena.shell.accounts import Language, Theme, top_role
from arena.shell.acts import send_later
from arena.shell.listing import read_listing, read_page
from arena.shell.steps import first_steps
from arena.site import demo
from arena.site.language import use_english
from arena.site.queries import count_failed, read_gauges
from arena.studies import queries as studies
from arena.templatetags.results import label_of
from arena.voting.queries.blinding import ResultsAccess, results_access
from augment.models import Benchmark, Event, GenerationJob
from augment.services.running import count_each

LATEST_JOBS = 5
ACTS_AT_ONCE = 15

# --- Home --------------------------------------------------------------------------------------


@require_safe
def home(request: HttpRequest) -> HttpResponse:
    """Show the page of the role that somebody has."""
    match top_role(request.user):
        case "expert":
            return _expert(request)
        case "entrant":
            use_english(request)
            own = submissions_for(get_user(request))[:5]
            context = {"own": own, "benchmarks": Benchmark.objects.filter(retired_at=None)}
            return render(request, "home/entrant.html", context)
        case "researcher":
            use_english(request)
            return render(request, "home/researcher.html", _studies_by_state())
        case "admin":
            use_english(request)
            return _admin(request)
        case _:
            return render(request, "home/nobody.html")


def _expert(request: HttpRequest) -> HttpResponse:
    expert = get_user(request)
    lines = studies.count_progress(studies.list_studies(expert), expert)
    closed = [line for line in lines if line.study.state == Study.State.CLOSED]
    is_open = [line for line in lines if line.study.state == Study.State.OPEN]
    context = {
        "to_do": [line for line in is_open if line.left],
        "finished": [line for line in is_open if not line.left],
        "closed": closed,
        "cancelled": [line for line in lines if line.study.state == Study.State.CANCELLED],
        "labellings": queries.find_labellings(tasks__expert=expert),
        "readable": {
            line.study.pk: results_access(user=expert, study=line.study) is ResultsAccess.FULL
            for line in closed
        },
    }
    return render(request, "home/expert.html", context)


def _admin(request: HttpRequest) -> HttpResponse:
    steps = first_steps()
    context = {
        "steps": steps,
        "following": next((step for step in steps if not step.found), None),
        "is_set_up": steps[-1].found,
        "failed": count_failed(),
        "submissions": count_waiting(),
        "jobs": count_each(list(GenerationJob.objects.all()[:LATEST_JOBS])),
        **_studies_by_state(),
    }
    return render(request, "home/admin.html", context)


def _studies_by_state() -> dict[str, list[studies.StudyProgress]]:
    lines = studies.count_progress(studies.list_studies())
    states = {"running": Study.State.OPEN, "closed": Study.State.CLOSED}
    return {
        name: [line for line in lines if line.study.state == state]
        for name, state in states.items()
    }


@act_for(ADMIN, back="home")
def use_demo(request: HttpRequest, name: str) -> HttpResponse | None:
    """Do one of the first steps with what the demo has."""
    if name not in demo.ACTS:
        raise Http404
    with transaction.atomic():
        # Held, so that a second click waits and finds what the first one made.
        actor = User.objects.select_for_update().get(pk=get_user(request).pk)
        made = demo.ACTS[name](actor)
        if isinstance(made, GenerationJob):
            send_later(request, made)
            return redirect("job", code=made.code)
    return redirect("results", code=made.code) if made else None


@require_POST
def choose(request: HttpRequest, what: str) -> HttpResponse:
    """Keep the theme or the language with the account, then go back to where it was chosen.

    The language is kept in this browser as well, for the pages before the login.
    """
    chosen, back = request.POST.get(what, ""), request.POST.get("next", "")
    is_ours = url_has_allowed_host_and_scheme(back, {request.get_host()}, request.is_secure())
    answer = redirect(back if is_ours and "/" in back else "home")  # else it names a view
    if chosen in set(Theme if what == "theme" else Language):
        keep_preference(get_user(request), **{what: chosen})
        if what == "language":
            keep_language(answer, Language(chosen))
    return answer


# --- The audit log -----------------------------------------------------------------------------


@page_for(ADMIN)
def audit_page(request: HttpRequest) -> HttpResponse:
    """A page of acts, the newest first."""
    acts = Event.objects.order_by()
    actors = Person.objects.filter(user__in=acts.values("actor")).order_by("pseudonym")
    people = [(str(code), name) for code, name in actors.values_list("code", "pseudonym")]
    verbs, kinds = (
        sorted(acts.values_list(column, flat=True).distinct())
        for column in ("verb", "object_kind")
    )
    listing = read_listing(
        request,
        {
            "actor": ("By", people),
            "verb": ("What", [(verb, label_of("verb_label", verb)) for verb in verbs]),
            "object_kind": ("To", [(kind, kind) for kind in kinds]),
        },
    )
    rows = Event.objects.select_related("actor__person").order_by("-at", "-pk")
    if actor := listing.find_choice("actor"):
        rows = rows.filter(actor__person__code=actor)
    rows = listing.narrow(rows, "object_code", by=["verb", "object_kind"])
    page = read_page(request, rows, size=ACTS_AT_ONCE)
    return render(request, "audit.html", {"page": page, "listing": listing})


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
    if top_role(request.user) != ADMIN and not opens_metrics(request.headers.get("Authorization")):
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
