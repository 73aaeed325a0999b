"""What load balancers and monitoring ask, and what each answer gives away."""

import socket
from datetime import timedelta

import pytest
from celery import current_app
from django.core.cache import cache
from django.db import OperationalError
from django.test import Client
from django.urls import reverse
from prometheus_client.parser import text_string_to_metric_families
from pytest_django import Settings

from arena.serving import readiness
from augment.errors import QueueUnreachable
from augment.models import Worker
from augment.services.clock import DATABASE_TIME
from augment.tasks import check_broker
from tests.brokers import Broker
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture(autouse=True)
def _nothing_held() -> None:
    cache.clear()


def a_worker() -> None:
    now = dict.fromkeys(("started_at", "seen_at", "recovered_at"), DATABASE_TIME)
    Worker.objects.create(name="w 1", **now)


def ask(path: str) -> tuple[int, dict[str, object]]:
    answer = Client().get(path)
    return answer.status_code, answer.json()


def test_a_whole_installation_is_ready(broker: Broker) -> None:
    a_worker()
    parts = {"database": "ok", "broker": "ok", "workers": "ok"}
    assert ask("/readyz") == (200, {"status": "ok", "parts": parts})


def test_without_broker_and_workers_it_is_not_ready(no_broker: None) -> None:
    parts = {"database": "ok", "broker": "unreachable", "workers": "none"}
    assert ask("/readyz") == (503, {"status": "down", "parts": parts})


def test_a_worker_that_was_silent_for_too_long_makes_it_unready(
    broker: Broker, settings: Settings
) -> None:
    a_worker()
    assert ask("/readyz")[0] == 200
    silent_s = timedelta(seconds=settings.STALE_AFTER_S + 1)
    Worker.objects.update(seen_at=DATABASE_TIME - silent_s)
    cache.clear()
    status, document = ask("/readyz")
    assert (status, document["parts"]["workers"]) == (503, "none")  # type: ignore[index]


def test_a_broker_that_takes_calls_and_never_answers_is_unreachable(broker: Broker) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        current_app.conf.broker_url = f"redis://127.0.0.1:{silent.getsockname()[1]}/0"
        with pytest.raises(QueueUnreachable):
            check_broker(within_s=0.1)


def test_without_the_tables_of_this_release_nobody_is_sent_here(
    broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(readiness, "find_unapplied_migrations", lambda: ["arena.0999_new"])
    status, document = ask("/readyz")
    assert (status, document["status"]) == (503, "down")
    assert "0999" not in str(document), "the inside is nobody's business"


def test_without_a_database_nobody_is_sent_here(
    broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unreachable() -> list[str]:
        raise OperationalError("password of arena at 10.0.0.7")

    monkeypatch.setattr(readiness, "find_unapplied_migrations", unreachable)
    status, document = ask("/readyz")
    assert (status, document["status"]) == (503, "down")
    assert "10.0.0.7" not in str(document)


def read(text: str) -> dict[tuple[str, str], float]:
    return {
        (sample.name, sample.labels.get("state", "")): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_metrics_count_the_rows() -> None:
    study = a_study()
    vote(matchups_of(study, "eva")[0], "left")
    a_worker()
    answer = signed_in(people()["admin"]).get(reverse("metrics"))
    found = read(answer.content.decode())
    assert found["arena_workers", ""] == 1
    assert found["arena_recovery", ""] == 1
    assert found["arena_votes", "open"] == 1
    assert found["arena_matchups", "open"] == study.matchups.count()
    assert found["arena_model_calls", "answered"] == 0
    assert found["arena_model_usd", ""] == 0


def test_metrics_open_to_the_token_of_the_settings(settings: Settings) -> None:
    settings.METRICS_TOKEN = "metrics-4711"
    for header, status in {
        **{"Bearer metrics-4711": 200, "bearer metrics-4711": 200, "Bearer metrics-4712": 401},
        **{"Bearer ": 401, "metrics-4711": 401, "": 401},
    }.items():
        headers = {"Authorization": header} if header else {}
        assert Client(headers=headers).get("/metrics").status_code == status, header


def test_without_a_token_in_the_settings_no_header_opens_them() -> None:
    assert Client(headers={"Authorization": "Bearer "}).get("/metrics").status_code == 401
