"""Brokers for tests that send messages: one in memory, and none."""

from collections.abc import Iterator
from contextlib import contextmanager

from celery import current_app

MEMORY = "memory://"
NOWHERE = "redis+socket:///nowhere/redis.sock"


@contextmanager
def broker_at(address: str) -> Iterator[None]:
    """Messages go there as long as the block lasts."""
    before = current_app.conf.broker_url
    current_app.conf.broker_url = address
    yield
    current_app.conf.broker_url = before


class Broker:
    """A broker in memory, and how many messages wait there."""

    def purge(self, queue: str = "models") -> None:
        with current_app.connection_for_write() as connection:
            channel = connection.default_channel
            channel.queue_declare(queue=queue)
            channel.queue_purge(queue)

    def __len__(self) -> int:
        with current_app.connection_for_write() as connection:
            declared = connection.default_channel.queue_declare(
                queue=current_app.conf.task_default_queue
            )
            return int(declared.message_count)
