"""The way to the workers: a connection that works, or a fault that names what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import redis
from celery import current_app
from kombu.exceptions import OperationalError

from augment.errors import QueueFault, QueueRefused, QueueUnreachable

REFUSALS = (redis.ResponseError, redis.AuthenticationError, redis.BusyLoadingError)
"""What a Redis says that is there and takes no messages: full, read only, loading, locked."""


def send(task: Any, *arguments: str | int) -> None:
    """One message, over a connection that works; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    with open_broker() as broker:
        task.apply_async(arguments, connection=broker, retry=False)


def check_broker(*, within_s: float = 5) -> None:
    """Raise QueueFault unless a broker can be reached and answers within so many seconds."""
    with open_broker(within_s=within_s):
        pass


@contextmanager
def open_broker(*, within_s: float = 5) -> Iterator[Any]:
    """A connection that works, tried once; what breaks inside the block is named as well.

    Args:
        within_s: How long it may take to connect, and to answer.

    Raises:
        QueueUnreachable: No broker.
        QueueRefused: It takes no messages.
    """
    with current_app.connection_for_write() as broker:
        broker.transport_options |= {
            "socket_connect_timeout": within_s,
            "socket_timeout": within_s,
        }
        try:
            broker.ensure_connection(max_retries=1, interval_start=0, timeout=within_s)
            yield broker
        except (OperationalError, redis.RedisError) as error:
            raise _fault(broker, error) from error


# --- Private -----------------------------------------------------------------------------------


def _fault(broker: Any, error: Exception) -> QueueFault:
    """What a failed message means: nobody there, or somebody who refuses."""
    # The password is masked, and the mask is shown even where there is none.
    address = broker.as_uri() if broker.password else broker.as_uri().replace(":**@", "")
    first: BaseException | None = error
    while first is not None:
        if isinstance(first, REFUSALS):
            return QueueRefused(address, str(first))
        first = first.__cause__
    return QueueUnreachable(address)
