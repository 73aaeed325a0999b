"""A request that was answered before is answered from the store, unless it is to be asked anew."""

from __future__ import annotations

from dataclasses import replace

import pytest

from augment.errors import ModelFault
from augment.llm.messages import Reply
from augment.models import Augmentation, GenerationJob, ModelCall
from augment.services.running import jobs
from tests.jobs.models import Model, llama_job, ran, reply
from tests.variants.answers import GOOD

pytestmark = pytest.mark.django_db

DONE = Augmentation.State.DONE


def again(*, is_fresh: bool = False) -> GenerationJob:
    return jobs.launch(
        name="Again", contestants=["llama"], scenarios=["street-1"], is_fresh=is_fresh
    )


def test_the_same_request_is_answered_once_and_the_copy_costs_nothing() -> None:
    model = Model()
    first = ran(llama_job(price="1"), model)
    job = again()
    second = ran(job, model)
    assert (second.state, second.modification) == (DONE, first.modification)
    assert len(model.requests) == 1
    source, copy = ModelCall.objects.order_by("pk")
    assert (copy.served_from, copy.answer, copy.request) == (source, source.answer, source.request)
    assert (copy.cost_nano_usd, copy.spent_tokens, copy.latency_s) == (0, 0, None)
    assert (copy.model_returned, copy.is_cached) == ("llama3.1-2407", True)
    job.refresh_from_db()
    assert (job.spent_calls, job.spent_nano_usd) == (0, 0)


def test_a_fault_is_no_answer() -> None:
    broken = Model(ModelFault("no", retryable=False, status=500))
    job = llama_job()
    ran(job, broken)
    jobs.retry_failed(job)
    model = Model()
    assert ran(job, model).state == DONE
    assert len(model.requests) == 1


def test_a_refusal_is_an_answer_and_stays_one() -> None:
    model = Model(lambda request: Reply(text="", refusal="I would rather not."))
    ran(llama_job(), model)
    row = ran(again(), model)
    assert (row.state, row.reason) == (Augmentation.State.REFUSED, "I would rather not.")
    assert len(model.requests) == 1


def test_an_answer_to_a_cut_prompt_is_kept_and_paid_for_but_never_served() -> None:
    cut = Model(lambda request: replace(reply(), prompt_tokens=12))
    job = llama_job(price="1")
    assert "silently cut" in ran(job, cut).reason
    call = ModelCall.objects.get()
    assert (call.answer, call.prompt_tokens) == (GOOD, 12)
    assert "silently cut" in call.fault
    job.refresh_from_db()
    assert job.spent_tokens > 0
    whole = Model()
    assert ran(again(), whole).state == DONE
    assert len(whole.requests) == 1
