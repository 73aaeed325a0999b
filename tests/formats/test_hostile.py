"""What strangers may hand us: every file is refused, in good time and memory.

Each is read as the product does it, so that the memory that it can take is the sandbox's.
"""

from __future__ import annotations

import resource
from pathlib import Path
from threading import Thread

import pytest

from augment.errors import InvalidDocument
from augment.formats.apart import UntrustedInput
from augment.formats.readers import READERS
from tests.formats.av2_logs import write_log
from tests.formats.hostile_files import HOSTILE, scenarionet_of_nested_tuples_as_a_key

MOST_CPU_S = 10.0
MOST_MB = 1024


def read(path: Path, source: str | None) -> None:
    UntrustedInput(path=path, format=source).read(item=None, frame=None, name="hostile")


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_in_good_time_and_a_gigabyte(name: str, tmp_path: Path) -> None:
    source, path = HOSTILE[name](tmp_path)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with pytest.raises(InvalidDocument, match=r"This .* can't be read: ") as fault:
        read(path, source)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{name}: {cpu_s:.1f} s, {after.ru_maxrss >> 10} MB: {str(fault.value)[:250]}")
    path.unlink() if path.suffix == ".zip" else None
    assert cpu_s < MOST_CPU_S
    assert after.ru_maxrss / 1024 < MOST_MB  # of all files so far


def test_a_frozen_reader_leaves_time_to_read_another_file(tmp_path: Path) -> None:
    _, hostile = scenarionet_of_nested_tuples_as_a_key(tmp_path)

    def freeze() -> None:
        with pytest.raises(InvalidDocument, match="computing"):
            read(hostile, "scenarionet")

    frozen = Thread(target=freeze)
    frozen.start()
    log = UntrustedInput(path=write_log(tmp_path / "log"))
    assert log.read(item=None, frame=None, name="street")[0] == READERS["av2"].name
    assert frozen.is_alive()
    frozen.join()
