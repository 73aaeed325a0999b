"""What a job is expected to use, and what no job can do."""

from __future__ import annotations

import io
from decimal import Decimal

import pytest
from django.core.management import call_command

from augment.errors import Conflict
from augment.models import Contestant, EndpointModel, GenerationJob
from augment.services.endpoints.contestants import add_contestant
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.running import jobs, runner
from augment.services.running.estimates import estimate
from augment.services.running.feasible import find_obstacle, keys_missing
from tests.jobs.models import MODEL, Model, add_llama, llama_job
from tests.jobs.rows import add_kind, add_scenario, only_row

pytestmark = pytest.mark.django_db


def test_without_earlier_runs_it_is_a_guess_from_the_prompts() -> None:
    add_llama(price="2")
    for number in range(4):
        add_scenario(f"street-{number}")
    add_kind("reference")
    found = estimate(["llama", "reference"], [f"street-{number}" for number in range(4)])
    (line,) = found.lines
    assert (found.rows, found.asking_rows, line.seen) == (8, 4, 0)
    assert line.calls == (4, 4, 8)
    assert 4 * 1000 < line.tokens_in < 4 * 8000
    assert line.tokens_out == 4 * 1200
    assert line.usd is not None
    assert line.usd_most is not None
    assert line.usd == Decimal(2) * (line.tokens_in + line.tokens_out) / 10**6
    assert line.usd_most > line.usd


def test_after_a_run_it_is_what_was_used() -> None:
    job = llama_job(price="1")
    runner.work_on(augmentation_pk=only_row(job).pk, connect=Model())
    for slug in ("other", "another"):
        add_scenario(slug)
    (line,) = estimate(["llama"], ["other", "another"]).lines
    assert (line.seen, line.tokens_in, line.tokens_out) == (1, 2 * 2900, 2 * 120)
    assert line.calls == (2, 2, 4)
    assert line.usd == Decimal("0.00604")


def test_what_was_answered_from_the_store_tells_nothing_of_the_cost() -> None:
    first = llama_job(price="1")
    runner.work_on(augmentation_pk=only_row(first).pk, connect=Model())
    again = jobs.launch(name="Again", contestants=["llama"], scenarios=["street-1"])
    runner.work_on(augmentation_pk=only_row(again).pk, connect=Model())
    add_scenario("other")
    (line,) = estimate(["llama"], ["other"]).lines
    assert (line.seen, line.tokens_in) == (1, 2900)


def test_an_unknown_price_stays_unknown() -> None:
    add_llama()
    add_scenario("street")
    found = estimate(["llama"], ["street"])
    assert found.lines == found.unpriced
    assert found.usd == 0


def test_a_cap_below_what_is_expected_covers_so_many_rows() -> None:
    add_llama(price="1")
    for number in range(10):
        add_scenario(f"street-{number}")
    found = estimate(["llama"], [f"street-{number}" for number in range(10)])
    assert found.rows_within(found.usd) is None
    assert found.rows_within(found.usd / 2) == 5


def test_contestants_that_no_job_can_run_say_why() -> None:
    ensure_endpoint(label="here", base_url="http://127.0.0.1:1/v1")
    blind = add_contestant(slug="blind", variant="vqa", endpoint="here", model=MODEL)
    assert "nobody knows whether its viewer llama3.1 at here sees pictures" in find_obstacle(blind)
    EndpointModel.objects.update_or_create(
        endpoint=blind.endpoint, model=MODEL, defaults={"vision": False}
    )
    assert "needs vision" in find_obstacle(blind)
    assert "imported" in find_obstacle(add_kind("by-hand", Contestant.Kind.HUMAN))
    add_scenario("street")
    with pytest.raises(Conflict, match="imported"):
        jobs.launch(name="J", contestants=["by-hand"], scenarios=["street"])


def test_a_key_that_is_missing_here_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    ensure_endpoint(label="here", base_url="http://127.0.0.1:1/v1", key_variable="SOME_API_KEY")
    keyed = add_contestant(slug="keyed", variant="otm", endpoint="here", model=MODEL)
    monkeypatch.delenv("SOME_API_KEY", raising=False)
    assert keys_missing(keyed) == ["SOME_API_KEY"]
    monkeypatch.setenv("SOME_API_KEY", "sk-secret")
    assert keys_missing(keyed) == []
    assert find_obstacle(keyed) == ""


def test_the_command_says_what_a_job_would_use_and_launches_nothing() -> None:
    add_llama(price="1")
    add_scenario("street")
    said = io.StringIO()
    call_command(
        *("generate", "--contestants", "llama", "reference", "--scenarios", "street"),
        "--estimate",
        stdout=said,
    )
    assert "2 to run, 1 of them ask models." in said.getvalue()
    assert "llama: calls 1 expected (1 to 2)" in said.getvalue()
    assert "(a guess from its prompts)" in said.getvalue()
    assert not GenerationJob.objects.exists()
