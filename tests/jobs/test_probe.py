"""The probe, over the real wire, at servers that can do more or less."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from arena.contestants.queries import probe_lines
from augment.llm.costs import least_tokens
from augment.llm.messages import LengthName, SchemaForm
from augment.llm.questions import MARKER, Ability
from augment.models import CallLease, Contestant, Endpoint, EndpointModel, Event
from augment.services.endpoints.known_models import model_at
from augment.services.endpoints.probing import ProbeReport, probe
from augment.services.running.choosing import find_obstacle
from tests.jobs.rows import add_model
from tests.llm.json_server import JsonServer, serving

pytestmark = pytest.mark.django_db
EVERYTHING = frozenset(
    {*("temperature", "tools", "images", "window", "usage", "seed"), *LengthName, *SchemaForm}
)
KEY = "sk-planted-4f7a9c0d1e2b3a"


class Candidate(JsonServer):
    """A server that can do what it is told it can."""

    def __init__(self, can: frozenset[str], status: int) -> None:
        super().__init__()
        self.can, self.status = can, status

    def answer(self, body: dict[str, Any]) -> tuple[int, dict[str, Any]]:
        refused = self._refused(body)
        if refused is not None:
            return refused
        content = body["messages"][0]["content"]
        if not isinstance(content, str) and "images" not in self.can:
            if "a filter" in self.can:
                return 400, _error("flagged: content_filter", None)
            return 400, _error("This model takes no image_url", None)
        message = {"role": "assistant", "content": self._said(body, content)}
        if "tools" in body:
            function = {"name": "double", "arguments": '{"number": 21}'}
            message["tool_calls"] = [{"id": "c1", "type": "function", "function": function}]  # type: ignore[assignment]
        text = content if isinstance(content, str) else content[0]["text"]
        prompt_tokens = least_tokens(text) + 8
        if "window" not in self.can:
            prompt_tokens = min(prompt_tokens, 4096)
        made = {"id": "1", "object": "chat.completion", "created": 0, "model": "m-2026"}
        made["choices"] = [{"index": 0, "finish_reason": "stop", "message": message}]
        if "usage" in self.can:
            written = 2
            if "story" in text:
                written = 16 if self.can.intersection(body) else 1200
            made["usage"] = {"prompt_tokens": prompt_tokens, "completion_tokens": written}
        return 200, made

    def _refused(self, body: dict[str, Any]) -> tuple[int, dict[str, Any]] | None:
        if self.status != 200:
            return self.status, _error(f"wrong key {KEY}", None)
        form = body.get("response_format", {}).get("type")
        for name in ("temperature", "seed", "tools"):
            if name in body and name not in self.can:
                return 400, _error(f"Unsupported: {name}", name)
        if form and self.can.isdisjoint({form, "ignores"}):
            return 500, _error("validation error: ('body', 'response_format', 'type')", None)
        return None

    def _said(self, body: dict[str, Any], content: Any) -> str | None:
        if not isinstance(content, str):
            return "Green, then yellow."
        if "tools" in body:
            return None
        if body.get("response_format", {}).get("type") in self.can:
            return json.dumps({"plate": MARKER, "doors": 4})
        if MARKER in content:
            return MARKER if "window" in self.can else "I was told no word."
        return "Ready, steady."


def _error(message: str, param: str | None) -> dict[str, Any]:
    return {"error": {"message": message, "type": "x", "param": param, "code": None}}


@contextmanager
def candidate(can: frozenset[str] = EVERYTHING, status: int = 200) -> Iterator[Candidate]:
    with serving(Candidate(can, status)) as server:
        Endpoint.objects.create(label="local", base_url=server.url)
        yield server


def asked() -> ProbeReport:
    known = model_at(endpoint=Endpoint.objects.get(), model="m")
    return probe(known)


def row() -> EndpointModel:
    return EndpointModel.objects.get(model="m")


def test_a_server_that_can_do_everything() -> None:
    with candidate():
        report = asked()
    assert {made.ability: made.has_it for made in report.findings} == dict.fromkeys(Ability, True)
    assert (report.calls, report.refused) == (7, [])
    assert {made.model_returned for made in report.findings} == {"m-2026"}
    known = row()
    abilities = (known.native_tools, known.vision, known.temperature)
    assert abilities == (True, True, True)
    assert known.probed_at == report.probed_at
    assert len(known.probe_report["findings"]) == 7
    assert Event.objects.get(verb="probe").object_code == str(known.code)
    assert CallLease.objects.filter(finished_at__isnull=False).count() == 7


@pytest.mark.parametrize(
    ("lacks", "has", "ability", "has_it"),
    [
        ("temperature", "", Ability.TEMPERATURE, False),
        ("tools", "", Ability.NATIVE_TOOLS, False),
        ("images", "", Ability.VISION, False),
        ("images", "a filter", Ability.VISION, None),
        ("window", "", Ability.WHOLE_PROMPT, False),
    ],
)
def test_what_a_server_can_not_do_is_found_and_nothing_else(
    lacks: str, has: str, ability: Ability, has_it: bool | None
) -> None:
    with candidate(EVERYTHING - {lacks} | {has}):
        report = asked()
    found = {made.ability: made.has_it for made in report.findings}
    assert found == dict.fromkeys(Ability, True) | {ability: has_it}


def test_a_limit_that_is_passed_over_is_sent_by_its_other_name() -> None:
    with candidate(EVERYTHING - {"max_completion_tokens"}):
        report = asked()
    assert report.has(Ability.ANSWER_LIMIT) is True
    assert report.refused == row().refused_parameters == ["max_completion_tokens"]
    assert report.calls == 8


@pytest.mark.parametrize(
    ("can", "has_it", "refused"),
    [
        ({SchemaForm.JSON_OBJECT}, True, ["json_schema"]),
        ({SchemaForm.JSON_OBJECT, "ignores"}, True, ["json_schema"]),
        (set[str](), False, ["json_object", "json_schema"]),
        ({"ignores"}, False, ["json_object", "json_schema"]),
    ],
)
def test_a_schema_is_asked_for_in_the_form_that_the_answer_obeys(
    can: set[str], has_it: bool, refused: list[str]
) -> None:
    with candidate(EVERYTHING - {*SchemaForm} | can):
        report = asked()
        add_model("small", endpoint=Endpoint.objects.get(), model="m", options={"block": "schema"})
    assert (report.has(Ability.SCHEMA), row().refused_parameters) == (has_it, refused)
    obstacle = find_obstacle(Contestant.objects.get(slug="small"))
    assert ("keeps to none" in obstacle) is not has_it


class Particular(Candidate):
    """Takes every parameter and one temperature."""

    def answer(self, body: dict[str, Any]) -> tuple[int, dict[str, Any]]:
        if body.get("temperature", 0.0) > 1.0:
            return 400, _error("temperature must be at most 1", "temperature")
        return super().answer(body)


def test_a_value_that_a_contestant_will_send_is_tried_before_it_runs() -> None:
    with serving(Particular(EVERYTHING, 200)) as server:
        endpoint = Endpoint.objects.create(label="local", base_url=server.url)
        for slug, options in (("cool", {"temperature": 0.5}), ("hot", {"temperature": 1.5})):
            add_model(slug, endpoint=endpoint, model="m", options=options)
        report = asked()
    assert (report.has(Ability.TEMPERATURE), row().temperature, report.refused) == (None, None, [])
    lines = {line["ability"]: line for line in probe_lines(row(), None)}
    assert lines["temperature"]["note"].endswith("400: temperature must be at most 1")
