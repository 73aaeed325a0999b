"""What a job is expected to use, and what no job can do."""

from __future__ import annotations

from decimal import Decimal

import pytest

from augment.services.running import runner
from augment.services.running.estimates import estimate
from tests.jobs.models import Model, add_llama, llama_job
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
