"""One supervisor for each folder, also when two are started in the same instant."""

from __future__ import annotations

import fcntl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from django.conf import settings

from arena.errors import ArenaError
from arena.serving.ledger import end_orphans
from arena.serving.probes import redis_answers

LOCK = "serving.lock"


class AlreadyRunning(ArenaError):
    """Another supervisor of the same folder is up."""


@contextmanager
def hold_alone(say: Callable[[str], None]) -> Iterator[None]:
    """Keep other supervisors out of this folder; nothing is kept where REDIS_URL is set.

    The system lets go of the lock when this process ends, however it ends. What an earlier one
    left behind that was killed is ended.

    Args:
        say: Gets a line where anything is ended.

    Raises:
        AlreadyRunning: Another one holds it, or left its Redis behind.
    """
    if not settings.REDIS_IS_PRIVATE:
        end_orphans(settings.VAR_DIR, say)
        yield
        return
    folder: Path = settings.VAR_DIR
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise AlreadyRunning(
                f"Scenario Arena runs or starts in this folder already ({folder / LOCK} is "
                "held). Stop it first."
            ) from error
        end_orphans(folder, say)
        if redis_answers(settings.PRIVATE_REDIS_SOCKET):
            raise AlreadyRunning(
                "Scenario Arena runs in this folder already (its private Redis answers on "
                f"{settings.PRIVATE_REDIS_SOCKET}). Stop it first."
            )
        yield
