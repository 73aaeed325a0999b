"""What programs ask: is this process up, can it serve, and how much is there to do."""

from __future__ import annotations

from collections.abc import Iterator

from django.contrib.auth.decorators import login_not_required
from django.http import HttpRequest, HttpResponse, JsonResponse
from django.views.decorators.http import require_safe
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.exposition import CONTENT_TYPE_LATEST
from prometheus_client.registry import Collector

from arena.queries.gauges import read_gauges
from arena.queries.people import role_of
from arena.serving.metrics_key import opens_metrics
from arena.serving.readiness import look_at_parts
from arena.web.access import ADMIN


@login_not_required
@require_safe
def healthz(request: HttpRequest) -> HttpResponse:
    """200 while this process answers at all; a container that does not is started again."""
    return JsonResponse({"status": "ok"})


@login_not_required
@require_safe
def readyz(request: HttpRequest) -> HttpResponse:
    """Whether to send people here, with a word for each part.

    503 where the database is missing or unprepared: no page can be served. Votes need neither
    broker nor workers, so without them the status is `degraded` with 200; `?strict` makes that
    503 as well, for whoever wants to be woken up.
    """
    parts = look_at_parts()
    database, *others = parts
    is_whole = all(part.is_ok for part in others)
    status = "down" if not database.is_ok else "ok" if is_whole else "degraded"
    refused = status == "down" or (status == "degraded" and "strict" in request.GET)
    document = {"status": status, "parts": {part.name: part.state for part in parts}}
    return JsonResponse(document, status=503 if refused else 200)


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
