"""A client for one endpoint that keeps to its limits and to what its models take.

How many calls an endpoint takes at once and in a minute counts over all workers: each call holds a
lease, a row. Whether there is room for one more is counted while the endpoint's row is locked (on
SQLite the transaction locks the whole file), so no two workers count the same place. A lease is
renewed as long as its call lasts; that of a dead worker runs out.
"""

import logging
import random
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from django.conf import settings
from django.db import Error, OperationalError, connection, transaction
from django.db.models import Q

from augment.errors import EndpointBusy, ParameterRefused
from augment.llm.client import Sending, watch_nothing
from augment.llm.messages import Reply, Request
from augment.llm.openai_wire import MEGABYTE, OpenAIWire
from augment.models import CallLease, Endpoint
from augment.services.clock import DATABASE_TIME, Moment, database_now, repeating
from augment.services.endpoints.contestants import Treatment
from augment.services.endpoints.known_endpoints import read_key
from augment.services.endpoints.known_models import read_facts, read_profile, remember_refusal

logger = logging.getLogger(__name__)

LEASE = timedelta(seconds=60)
RENEW_EVERY_S = 15.0
MINUTE = timedelta(seconds=61)
"""A second more than a minute, because a call is sent a little after it was admitted."""

_CLEAR_EVERY = 64
_FIRST_WAIT_S, _LONGEST_WAIT_S = 0.05, 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Queue:
    """Order in which a call waits for its place.

    Attributes:
        longest_s: A call that has waited that long gives up.
        still_wanted: Asked at every look; raises where nobody needs the call any more.
        clock: What time it is, the same for every worker.
        sleep: Waits for that many seconds.
        rng: Where the jitter comes from, so that waiting calls do not look in step.
        minute: Within which starts are counted.
        renew_every_s: How often the lease of a long call is renewed.
    """

    longest_s: float = field(default_factory=lambda: float(settings.LLM_QUEUE_S))
    still_wanted: Callable[[], None] = lambda: None
    clock: Callable[[], Moment] = lambda: DATABASE_TIME
    sleep: Callable[[float], None] = time.sleep
    rng: random.Random = field(default_factory=random.Random)
    minute: timedelta = MINUTE
    renew_every_s: float = RENEW_EVERY_S


class EndpointClient(AbstractContextManager["EndpointClient"]):
    """The wire to an endpoint, behind its queue.

    Args:
        wire: Makes the calls; it is closed with this client.
        endpoint: Whose limits and models count.
        queue: How calls wait for their place.
        treatment: What the contestant that asks has sent since its first run; None where nobody
            in particular asks, and what is known now counts.
    """

    def __init__(
        self,
        wire: OpenAIWire,
        endpoint: Endpoint,
        queue: Queue | None = None,
        treatment: Treatment | None = None,
    ) -> None:
        self._wire = wire
        self._endpoint = endpoint
        self._queue = queue or Queue()
        self._treatment = treatment
        self._profiles = {} if treatment is None else treatment.at(endpoint)

    def fit(self, request: Request) -> Request:
        """Return the request with what the model is known to take.

        Raises:
            ModelFault: It can't do without something that the model lacks.
        """
        if request.model not in self._profiles:
            facts = read_facts(endpoint=self._endpoint, model=request.model)
            self._profiles[request.model] = read_profile(facts)
        return self._profiles[request.model].fit(request)

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        """Return the endpoint's answer, after waiting for a place.

        Raises:
            ParameterRefused: A parameter is not taken; it is left out from now on.
            ModelFault: A parameter is not taken any more that earlier answers were made with.
            EndpointBusy: There was no place.
            ModelFault: There was no answer.
            LeaseLost: Nobody needs the answer any more; nothing was sent.
        """
        try:
            with place_at(self._endpoint, self._queue):
                return self._wire.complete(request, sending=sending)
        except ParameterRefused as refused:
            endpoint, model, parameter = self._endpoint, request.model, refused.parameter
            logger.warning(
                "%s at endpoint %s does not take %r and is not sent it any more: %s",
                *(model, endpoint.label, parameter, refused),
            )
            refusal = remember_refusal(endpoint=endpoint, model=model, parameter=parameter)
            if self._treatment is not None:
                refusal = self._treatment.without(refused, endpoint=endpoint, model=model)
            self._profiles[model] = refusal
            raise

    def __exit__(self, *fault: object) -> None:
        self._wire.close()


def wire_to(
    endpoint: Endpoint,
    *,
    still_wanted: Callable[[], None] = watch_nothing,
    timeout_s: float | None = None,
) -> OpenAIWire:
    """Return a wire with the endpoint's key; its calls are given up where `still_wanted` raises.

    Raises:
        KeyNotAllowed: The variable that the endpoint names is not meant for keys.
        KeyMissing: It is not set here.
        ModelFault: The key can't be sent.
    """
    return OpenAIWire(
        base_url=endpoint.base_url,
        api_key=read_key(endpoint),
        timeout_s=timeout_s or settings.LLM_TIMEOUT_S,
        most_bytes=settings.LLM_ANSWER_MB * MEGABYTE,
        still_wanted=still_wanted,
        proxy_url=settings.LLM_PROXY,
    )


@contextmanager
def place_at(endpoint: Endpoint, queue: Queue) -> Iterator[None]:
    """Hold one of the endpoint's places while the block runs, after waiting for it.

    Raises:
        EndpointBusy: None was free for as long as the queue allows.
    """
    lease = CallLease.objects.filter(token=_wait_for_place(endpoint, queue))

    def renew() -> bool:
        """A database that can't renew the lease now gets another try at the next beat."""
        try:
            is_held = lease.filter(finished_at=None).update(expires_at=queue.clock() + LEASE)
        except Error as error:
            logger.warning("A call's lease was not renewed: %s", error)
            connection.close()
            return True
        return bool(is_held)

    try:
        with repeating(renew, every_s=queue.renew_every_s, name="call lease"):
            yield
    finally:
        try:
            lease.update(finished_at=queue.clock())
        except OperationalError as error:  # no answer may be lost by it
            logger.warning("A call's place was not given back and runs out by itself: %s", error)
            if not connection.in_atomic_block:
                connection.close_if_unusable_or_obsolete()


@transaction.atomic
def admit(
    *, endpoint_pk: int, clock: Callable[[], Moment], minute: timedelta = MINUTE
) -> uuid.UUID | float:
    """Take a place, or say in how many seconds to look again (0: when a call ends).

    The clock is read after the lock is held: the wait for it may have been long.
    """
    endpoint = Endpoint.objects.select_for_update(no_key=True).get(pk=endpoint_pk)
    now = clock()
    wait_s = _wait_s(endpoint, now, minute)
    if wait_s is not None:
        return wait_s
    lease = CallLease.objects.create(endpoint=endpoint, started_at=now, expires_at=now + LEASE)
    if lease.pk % _CLEAR_EVERY == 0:
        old = CallLease.objects.filter(endpoint=endpoint, started_at__lt=now - 2 * minute)
        old.filter(Q(finished_at__isnull=False) | Q(expires_at__lt=now)).delete()
    return lease.token


# --- Private -----------------------------------------------------------------------------------


def _wait_s(endpoint: Endpoint, now: Moment, minute: timedelta) -> float | None:
    """Return None where there is room for a call now, else when to look again."""
    leases = CallLease.objects.filter(endpoint=endpoint)
    if leases.filter(finished_at=None, expires_at__gt=now).count() >= endpoint.max_concurrency:
        return 0.0
    limit = endpoint.requests_per_minute
    if limit is None:
        return None
    recent = leases.filter(started_at__gt=now - minute).order_by("-started_at")
    # With as many starts in the last minute as are allowed, the oldest of them has to age.
    oldest = recent.values_list("started_at", flat=True)[limit - 1 : limit].first()
    if oldest is None:
        return None
    now = now if isinstance(now, datetime) else database_now()
    return (oldest + minute - now).total_seconds()


def _wait_for_place(endpoint: Endpoint, queue: Queue) -> uuid.UUID:
    """Return the token of a place, after waiting for it."""
    give_up_at = time.monotonic() + queue.longest_s
    backoff_s = _FIRST_WAIT_S
    place = admit(endpoint_pk=endpoint.pk, clock=queue.clock, minute=queue.minute)
    while not isinstance(place, uuid.UUID):
        queue.still_wanted()
        if time.monotonic() > give_up_at:
            raise EndpointBusy(
                f"no place was free at endpoint {endpoint.label!r} for {queue.longest_s:g} s: "
                "raise its limits or run fewer workers"
            )
        backoff_s = min(2.0 * backoff_s, _LONGEST_WAIT_S)
        shortest_s = min(max(place, 0.5 * backoff_s), _LONGEST_WAIT_S)
        queue.sleep(shortest_s + 0.5 * backoff_s * queue.rng.random())
        # Look without a lock first: waiting calls must not keep workers from writing.
        limits = Endpoint.objects.filter(pk=endpoint.pk).first()
        wait_s = None if limits is None else _wait_s(limits, queue.clock(), queue.minute)
        if wait_s is None:
            place = admit(endpoint_pk=endpoint.pk, clock=queue.clock, minute=queue.minute)
        else:
            place = wait_s
    return place
