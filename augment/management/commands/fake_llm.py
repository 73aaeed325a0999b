"""Run the stand-in language-model server."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from django.core.management.base import CommandError

from augment.fake_llm.server import MODELS, running
from augment.services.scenarios.prompts import find_stored_tasks
from augment.services.terminal import TerminalCommand

_STOP = (signal.SIGINT, signal.SIGTERM)


class Command(TerminalCommand):
    """Serves /v1/chat/completions without a model, until it is interrupted."""

    help = (
        "Run the stand-in language-model server (OpenAI-compatible, no key needed). It reads no "
        "English: it looks up the stored intents by the text of the instruction. What it does "
        f"is chosen by the model: {', '.join(MODELS)}."
    )
    requires_system_checks = ()

    arguments = {
        "--port": {"type": int, "default": 8099, "help": "0 takes a free one"},
        "--host": {"default": "127.0.0.1"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Serve until SIGINT or SIGTERM."""
        host, port = options["host"], options["port"]
        try:
            with (
                _until_signalled() as wait,
                running(host, port, known=find_stored_tasks) as server,
            ):
                self.stdout.write(f"The stand-in language model listens on {server.url}")
                self.stdout.flush()
                wait()
        except (OSError, OverflowError) as error:
            raise CommandError(f"Can't listen on {host} port {port}: {error}") from None
        self.stdout.write("The stand-in language model has stopped.")


@contextmanager
def _until_signalled() -> Iterator[Callable[[], object]]:
    """A function that waits for SIGINT or SIGTERM; the old handlers return afterwards.

    Numpy's threads may be the ones that get the signal, which interrupts no waiting of this one.
    The wake-up descriptor is written to at once, whichever thread it is.
    """
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    descriptor = signal.set_wakeup_fd(writing)
    before = [signal.signal(number, lambda *_: None) for number in _STOP]
    try:
        yield lambda: os.read(reading, 1)
    finally:
        for number, handler in zip(_STOP, before, strict=True):
            signal.signal(number, handler)
        signal.set_wakeup_fd(descriptor)
        os.close(reading)
        os.close(writing)
