"""Writers of SQLite queue at a file; PostgreSQL queues them itself."""

import fcntl
import threading
from pathlib import Path

import pytest
from django.db import connection, transaction

from arena.voting.services.turns import SUFFIX, in_turn

pytestmark = pytest.mark.django_db(transaction=True)
LONG_S = 60.0


def queue() -> Path:
    return Path(str(connection.settings_dict["NAME"]) + SUFFIX)


def is_free() -> bool:
    with queue().open("ab") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


def test_who_comes_second_waits_until_the_first_is_done() -> None:
    order: list[str] = []
    comes = threading.Event()

    def second() -> None:
        comes.set()
        with in_turn():
            order.append("second")

    thread = threading.Thread(target=second)
    with in_turn():
        thread.start()
        assert comes.wait(LONG_S)
        assert not is_free()
        order.append("first")
    thread.join(LONG_S)
    assert order == ["first", "second"]


def test_a_turn_ends_with_an_error_too() -> None:
    with pytest.raises(RuntimeError, match="on the way"), in_turn():
        raise RuntimeError("on the way")
    assert is_free()


def test_nobody_waits_for_a_turn_while_holding_the_database() -> None:
    with in_turn():
        pass
    with queue().open("ab") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with transaction.atomic(), in_turn():
            pass  # would wait for ever
