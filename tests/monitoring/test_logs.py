"""One id leads from the request of a browser to the lines of the worker."""

import io
import json
import logging
import logging.config
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import pytest
from celery import current_app
from celery.signals import before_task_publish, task_postrun, task_prerun
from django.conf import settings
from django.http import HttpRequest, HttpResponse
from django.test import RequestFactory

from arena.config.celery import REQUEST_ID
from arena.config.logs import (
    NOBODY,
    AddRequestId,
    RequestIdMiddleware,
    current_request_id,
    working_for,
)
from augment.services.work import KINDS


def ask(given: str) -> tuple[str, str]:
    """What the view sees, and what the answer says."""
    seen = []

    def view(request: HttpRequest) -> HttpResponse:
        seen.append(current_request_id())
        return HttpResponse()

    answer = RequestIdMiddleware(view)(RequestFactory(headers={"X-Request-ID": given}).get("/"))
    return seen[0], answer.headers["X-Request-ID"]


def test_the_id_of_a_proxy_is_kept() -> None:
    assert ask("proxy-0000.1") == ("proxy-0000.1", "proxy-0000.1")
    assert current_request_id() == NOBODY


@pytest.mark.parametrize("given", ["short", "x" * 65, "two\nlines-of-log", "ä" * 9, ""])
def test_what_is_no_id_gets_one_of_ours(given: str) -> None:
    seen, said = ask(given)
    assert seen == said != given
    assert len(seen) == 16


@pytest.fixture
def stream() -> Iterator[io.StringIO]:
    """The product's own JSON handler, writing here."""
    made = io.StringIO()
    config: dict[str, Any] = deepcopy(settings.LOGGING)
    spec = config["formatters"]["json"]
    handler = logging.StreamHandler(made)
    configurator = logging.config.DictConfigurator({"version": 1})
    handler.setFormatter(configurator.configure_formatter(spec))
    handler.addFilter(AddRequestId())
    logger = logging.getLogger("tests.monitoring")
    logger.addHandler(handler)
    yield made
    logger.removeHandler(handler)


def test_a_line_of_json_says_when_how_bad_who_and_for_which_request(stream: io.StringIO) -> None:
    with working_for("request-1"):
        logging.getLogger("tests.monitoring").warning("%d rows\nof a job", 3)
    (line,) = stream.getvalue().splitlines()
    found = json.loads(line)
    assert found["message"] == "3 rows\nof a job"
    assert found["level"] == "WARNING"
    assert found["request_id"] == "request-1"
    assert found["name"] == "tests.monitoring"
    assert {"at", "process", "thread"} <= found.keys()


def test_a_message_carries_the_id_to_the_task() -> None:
    headers: dict[str, object] = {}
    with working_for("request-1"):
        before_task_publish.send(sender="augment.work", headers=headers)
    assert headers[REQUEST_ID] == "request-1"

    task = current_app.tasks["augment.draw"]
    task.push_request(**headers)
    try:
        task_prerun.send(sender=task, task_id="1", task=task)
        assert current_request_id() == "request-1"
        task_postrun.send(sender=task, task_id="1", task=task)
        assert current_request_id() == NOBODY
    finally:
        task.pop_request()


def test_drawing_and_driving_wait_in_a_queue_of_their_own() -> None:
    for task in ("augment.draw", "arena.draw_checks"):
        assert current_app.amqp.router.route({}, task)["queue"].name == "drawing"
    asking = {"augmentation", "intentreading", "probe"}
    assert {name for name, kind in KINDS.items() if kind.queue == "models"} == asking
