"""What a contestant's augmentations took, over attempts that broke and answers from the store."""

from collections.abc import Iterator

import pytest
from django.db.models import Q

from augment.errors import ModelFault
from augment.llm.messages import Reply, Request
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.endpoints.known_models import CONTESTANT, Spending, sum_spending
from augment.services.running import jobs, runner
from augment.services.running.jobs import JobRequest
from tests.jobs.models import Model, llama_job, reply
from tests.jobs.rows import only_row
from tests.variants.playing import GOOD

pytestmark = pytest.mark.django_db

BUSY = ModelFault("busy", retryable=True, status=503, retry_after_s=0.001)


def spent(job: GenerationJob, model: Model) -> Spending:
    row = only_row(job)
    runner.Augmentations(model).perform(row.pk)
    row.refresh_from_db()
    assert row.state == Augmentation.State.DONE
    found = sum_spending(Q(attempt__augmentation=row), by=CONTESTANT)
    return found[Contestant.objects.get().pk]


def once_busy() -> Model:
    faults: Iterator[ModelFault] = iter([BUSY])

    def answer(request: Request) -> Reply:
        for fault in faults:
            raise fault
        return reply()

    return Model(answer)


def test_an_error_of_the_endpoint_is_a_call_that_used_nothing() -> None:
    found = spent(llama_job(price="1"), once_busy())
    assert found == Spending(augmentations=1, calls=2, tokens=3020, nano_usd=3_020_000)


def test_an_answer_from_the_store_counts_as_what_it_had_cost() -> None:
    first = llama_job(price="1")
    spent(first, Model())
    again = jobs.launch(JobRequest(name="Again", contestants=["llama"], scenarios=["street-1"]))
    found = spent(again, Model())
    assert found == Spending(augmentations=1, calls=1, tokens=3020, nano_usd=3_020_000)


def test_usage_that_nobody_told_is_unknown_also_in_a_copy() -> None:
    silent = Model(lambda request: Reply(text=GOOD))
    assert spent(llama_job(price="1"), silent).tokens is None
    again = jobs.launch(JobRequest(name="Again", contestants=["llama"], scenarios=["street-1"]))
    assert spent(again, Model()).tokens is None
