"""The log as JSON, and which queue takes which task."""

import io
import json
import logging
import logging.config
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import pytest
from celery import current_app
from django.conf import settings

from augment.services.work import KINDS


@pytest.fixture
def stream() -> Iterator[io.StringIO]:
    """The product's own JSON handler, writing here."""
    made = io.StringIO()
    config: dict[str, Any] = deepcopy(settings.LOGGING)
    spec = config["formatters"]["json"]
    handler = logging.StreamHandler(made)
    configurator = logging.config.DictConfigurator({"version": 1})
    handler.setFormatter(configurator.configure_formatter(spec))
    logger = logging.getLogger("tests.monitoring")
    logger.addHandler(handler)
    yield made
    logger.removeHandler(handler)


def test_a_line_of_json_says_when_how_bad_and_who(stream: io.StringIO) -> None:
    logging.getLogger("tests.monitoring").warning("%d rows\nof a job", 3)
    (line,) = stream.getvalue().splitlines()
    found = json.loads(line)
    assert found["message"] == "3 rows\nof a job"
    assert found["level"] == "WARNING"
    assert found["name"] == "tests.monitoring"
    assert {"at", "process", "thread"} <= found.keys()


def test_drawing_and_driving_wait_in_a_queue_of_their_own() -> None:
    for task in ("augment.draw", "arena.draw_checks"):
        assert current_app.amqp.router.route({}, task)["queue"].name == "drawing"
    asking = {"augmentation", "intentreading", "pairjudgement", "probe"}
    assert {name for name, kind in KINDS.items() if kind.queue == "models"} == asking
