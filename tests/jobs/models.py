"""Language models for the tests of jobs: what they answer, and what they were asked."""

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict
from datetime import date
from decimal import Decimal

from augment.errors import ModelFault
from augment.llm.client import ChatClient, Sending, watch_nothing
from augment.llm.messages import Reply, Request
from augment.models import Augmentation, Contestant, Endpoint, EndpointModel, GenerationJob
from augment.services.running import jobs, runner
from augment.services.running.budget import NO_CAPS, Caps
from augment.services.running.jobs import JobRequest
from tests.jobs.rows import INSTRUCTION, add_model, add_scenario, only_row
from tests.llm.scripted import ScriptedClient
from tests.variants.playing import GOOD

MODEL = "llama3.1"
PROMPT_TOKENS, COMPLETION_TOKENS = 2900, 120

Answer = Callable[[Request], Reply]


def reply(text: str = GOOD) -> Reply:
    return Reply(
        text=text,
        model="llama3.1-2407",
        finish_reason="stop",
        prompt_tokens=PROMPT_TOKENS,
        completion_tokens=COMPLETION_TOKENS,
        latency_s=0.1,
    )


def after_a_second_look(request: Request) -> Reply:
    """Nonsense at first, a good answer when asked again: two calls for each augmentation."""
    return reply(GOOD if len(request.messages) > 2 else "Sorry?")


class Model:
    """Answers every request the same way, from any thread, and remembers them all.

    Args:
        answer: What it answers, or what it breaks with.
        looking_on: Is called while a call is in flight.
        waiting: Is called before it, while the call waits for its place.
    """

    def __init__(
        self,
        answer: Answer | BaseException | None = None,
        *,
        looking_on: Callable[[], None] = lambda: None,
        waiting: Callable[[], None] = lambda: None,
    ) -> None:
        self.requests: list[Request] = []
        self._answer = answer or (lambda request: reply())
        self._looking_on = looking_on
        self._waiting = waiting
        self._lock = threading.Lock()

    def fit(self, request: Request) -> Request:
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        self._waiting()
        sending()
        with self._lock:
            self.requests.append(request)
        self._looking_on()
        if isinstance(self._answer, BaseException):
            raise self._answer
        return self._answer(request)

    def __call__(self, endpoint: Endpoint) -> AbstractContextManager[ChatClient]:
        return self._session()

    @contextmanager
    def _session(self) -> Iterator[ChatClient]:
        yield self


def add_llama(slug: str = "llama", *, price: str | None = None) -> Contestant:
    """A contestant at a local endpoint; at that price per million tokens, in and out."""
    endpoint, _ = Endpoint.objects.get_or_create(
        label="local", defaults={"base_url": "http://127.0.0.1:9/v1"}
    )
    if price is not None:
        set_price(endpoint, price)
    return add_model(slug, endpoint=endpoint, model=MODEL)


def set_price(endpoint: Endpoint, usd: str) -> None:
    price = {"price_in_usd": Decimal(usd), "price_out_usd": Decimal(usd)}
    EndpointModel.objects.update_or_create(
        endpoint=endpoint,
        model=MODEL,
        defaults=price | {"price_as_of": date(2026, 11, 20), "price_source": "made up"},
    )


def llama_job(
    *, scenarios: int = 1, price: str | None = None, is_fresh: bool = False, caps: Caps = NO_CAPS
) -> GenerationJob:
    """A job of one contestant on scenarios that differ by their instruction."""
    add_llama(price=price)
    slugs = [f"street-{number}" for number in range(1, scenarios + 1)]
    for number, slug in enumerate(slugs):
        add_scenario(slug, instruction=f"{INSTRUCTION} Not more than {number + 1}.")
    return jobs.launch(
        JobRequest(
            name="Round 1",
            contestants=["llama"],
            scenarios=slugs,
            **asdict(caps),
            is_fresh=is_fresh,
        )
    )


class Wire:
    """Endpoints that all answer from one script, and what they were asked for."""

    def __init__(self, *answers: str | Reply | ModelFault) -> None:
        self.client: ChatClient = ScriptedClient(answers)
        self.opened: list[str] = []

    def __call__(self, endpoint: Endpoint) -> AbstractContextManager[ChatClient]:
        self.opened.append(endpoint.label)
        return self._session()

    @contextmanager
    def _session(self) -> Iterator[ChatClient]:
        yield self.client


def ran(
    work: Augmentation | GenerationJob,
    connect: Callable[[Endpoint], AbstractContextManager[ChatClient]] | None = None,
) -> Augmentation:
    """Run a row, or the only one of a job; both are read anew."""
    row = work if isinstance(work, Augmentation) else only_row(work)
    assert runner.Augmentations(connect or Wire()).perform(row.pk, worker="w")
    row.refresh_from_db()
    work.refresh_from_db()
    return row
