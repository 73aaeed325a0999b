"""What strangers may hand us: every file is refused, in good time and memory.

Each is read as the product does it, so that the memory that it can take is the sandbox's.
"""

import re
import resource
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import pytest

from augment.errors import InvalidDocument
from augment.formats.apart import UntrustedInput
from tests.formats.hostile_files import HOSTILE

MOST_CPU_S = 10.0
MOST_MB = 1024


class Refusal(NamedTuple):
    """What the reading process of one file said and took; memory is that of all files so far."""

    reason: str
    cpu_s: float
    most_mb: float


@pytest.fixture(scope="module")
def reader() -> Iterator[ProcessPoolExecutor]:
    """A fresh process, so that no browser or service of another test counts as its child."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        yield pool


def read(path: Path, source: str | None) -> None:
    UntrustedInput(path=path, format=source).read(item=None, frame=None, name="hostile")


def refuse(path: Path, source: str | None) -> Refusal:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with pytest.raises(InvalidDocument) as fault:
        read(path, source)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Refusal(str(fault.value), cpu_s, after.ru_maxrss / 1024)


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_in_good_time_and_a_gigabyte(
    name: str, tmp_path: Path, reader: ProcessPoolExecutor
) -> None:
    source, path = HOSTILE[name](tmp_path)
    refusal = reader.submit(refuse, path, source).result()
    print(f"{name}: {refusal}")
    path.unlink() if path.suffix == ".zip" else None
    assert re.match(r"This .* can't be read: ", refusal.reason)
    assert refusal.cpu_s < MOST_CPU_S
    assert refusal.most_mb < MOST_MB
