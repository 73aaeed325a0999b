"""Only one supervisor runs in a folder."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from django.conf import settings
from django.test import override_settings

from arena.serving.stack import LOCK, AlreadyRunning, hold_alone


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path) -> Iterator[None]:
    folder = tmp_path / "var"
    with override_settings(
        VAR_DIR=folder, PRIVATE_REDIS_SOCKET=folder / "redis.sock", REDIS_IS_PRIVATE=True
    ):
        yield


def test_a_second_supervisor_is_kept_out_while_the_first_is_there() -> None:
    with (
        hold_alone(print),
        pytest.raises(AlreadyRunning, match=r"serving\.lock is held"),
        hold_alone(print),
    ):
        pytest.fail("two hold the same folder")


@override_settings(REDIS_IS_PRIVATE=False)
def test_with_a_redis_of_their_own_several_may_run() -> None:
    with hold_alone(print), hold_alone(print):
        assert not (settings.VAR_DIR / LOCK).exists()
