"""Whatever the document allows or refuses, asked in every role: no fault of ours, nothing unsaid.

Every answer must have a status, a content type and a body that the document knows. The examples
are the same in every run; what one of them changes is taken back before the next.
"""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from django.core.signals import request_finished, request_started
from django.core.wsgi import get_wsgi_application
from django.db import close_old_connections, transaction
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi import checks

from arena.results.services.ratings import open_early
from arena.results.services.ratings import rate_now as rate
from augment.models import EndpointModel, Probe
from tests.api.tokens import secret_of
from tests.study_rows import matchups_of, vote
from tests.web.addresses import code_of
from tests.web.cast import World, people, world

pytestmark = [pytest.mark.django_db, pytest.mark.slow]

EXAMPLES = 4
CHECKS: list[Any] = [
    not_a_server_error,
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_schema_conformance,
]
ROLES = ("expert", "researcher", "admin")
"""Strangers get nothing (test_resources.py), entrants their own (journeys/test_entering.py)."""
OF_EXPERTS = {"listStudies", "listMatchups", "getShownPicture"}
OF_EXPERTS |= {"keepPreferences", "report", "vote"}
EXPORTS = {"jobs": ("tool-calls", "csv"), "snapshots": ("leaderboard", "latex")}
READ_BY_STAFF = {
    *("listJobs", "getJob", "getJobProgress", "exportJob", "listStudies", "getStudy"),
    *("listScenarios", "listContestants", "getUpload", "getMoment", "getProbe"),
    *("rateStudy", "getSnapshot", "exportSnapshot", "getSubmission"),
    *("getSweep", "getAugmentation"),
}

Seen = dict[str, set[int]]


@pytest.fixture(autouse=True)
def one_connection() -> Iterator[None]:
    """Let requests end without closing the database, as Django's own test client does."""
    signals = (request_started, request_finished)
    for signal in signals:
        signal.disconnect(close_old_connections)
    yield
    for signal in signals:
        signal.connect(close_old_connections)


@pytest.fixture
def here() -> World:
    """A study with votes and a rating, seen early by its staff; a job; a recording; a model."""
    found = world()
    for matchup in matchups_of(found.study, "eva")[:4]:
        vote(matchup, "left")
    rate(study=found.study, rounds=20, early=True)
    Probe.objects.create(model=EndpointModel.objects.get(code=str(code_of("models", found))))
    return found


def ask_all(role: str, here: World) -> Seen:
    """Ask for every operation in a role; by its name, the statuses that came."""
    accounts = people()
    user = here.expert if role == "expert" else accounts[role]
    reader = accounts["researcher"] if role == "expert" else user
    headers = {"Authorization": f"Bearer {secret_of(user)}"}
    if role != "expert":
        open_early(study=here.study, actor=user)
    document = schemathesis.openapi.from_wsgi(
        "/api/v1/openapi.json",
        app=get_wsgi_application(),
        headers={"Authorization": f"Bearer {secret_of(reader)}"},
    )
    seen: Seen = defaultdict(set)
    for result in document.get_all_operations():
        operation: Any = result.ok()  # type: ignore[union-attr] # raises where it is none
        name = operation.definition.raw["operationId"]
        seen[name] |= ask(operation, headers, here)
    return seen


def ask(operation: Any, headers: dict[str, str], here: World) -> set[int]:
    """Some requests to one operation, half of them about rows that are there."""
    statuses: set[int] = set()
    word = operation.path.removeprefix("/api/v1/").partition("/")[0]
    code = str(code_of(word, here))
    token = here.study.matchups.filter(expert=here.expert)[0].left_token
    right, wrong = (operation.as_strategy(mode) for mode in GenerationMode)

    @settings(
        max_examples=EXAMPLES,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(case=st.one_of(right, wrong), is_there=st.sampled_from([True, True, False]))
    def send(case: Any, is_there: bool) -> None:
        if is_there and "code" in (case.path_parameters or {}):
            case.path_parameters["code"] = code
        if is_there and "name" in (case.path_parameters or {}):
            case.path_parameters["name"], case.path_parameters["form"] = EXPORTS[word]
        if is_there and "token" in (case.path_parameters or {}):
            case.path_parameters["token"] = token
        with transaction.atomic():
            answer = case.call(headers=headers)
            transaction.set_rollback(True)
        case.validate_response(answer, checks=CHECKS, headers=headers)
        statuses.add(answer.status_code)

    send()
    return statuses


@pytest.mark.parametrize("role", ROLES)
def test_every_answer_is_one_that_the_document_knows(role: str, here: World) -> None:
    seen = ask_all(role, here)
    fine = {name for name, statuses in seen.items() if any(status < 300 for status in statuses)}
    if role == "expert":
        assert fine <= OF_EXPERTS, seen
    else:
        assert fine >= READ_BY_STAFF, seen
        assert ("closeStudy" in fine) is (role == "admin")
