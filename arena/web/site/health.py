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
from arena.serving.readiness import look_at_parts, opens_metrics
from arena.web.access import ADMIN


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
