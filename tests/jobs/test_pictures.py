import os
import subprocess
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from django.conf import LazySettings
from django.core.files.storage import default_storage
from pytest_django import Settings

from augment.models import Augmentation, ModelCall
from augment.services.running import jobs
from augment.services.scenarios.pictures import original_picture, store
from tests.jobs.models import Wire, llama_job, ran
from tests.variants.playing import GOOD

WORKERS = 4


def read(name: str) -> bytes:
    with default_storage.open(name) as file:
        return bytes(file.read())


def test_workers_with_one_picture_never_meet_half_of_it(
    settings: Settings, tmp_path: Path
) -> None:
    settings.MEDIA_ROOT = tmp_path
    for number in range(20):
        png = bytes([number]) * 3_000_000
        together = threading.Barrier(WORKERS)

        def store_and_read(
            _: int, png: bytes = png, together: threading.Barrier = together
        ) -> bool:
            together.wait()
            return read(store(png)) == png

        with ThreadPoolExecutor(WORKERS) as pool:
            assert all(pool.map(store_and_read, range(WORKERS)))
    assert len(default_storage.listdir("bev")[1]) == 20, "nothing else is left behind"


pytestmark = pytest.mark.django_db
State = Augmentation.State
BYTES = 256 * 1024
LEFT = 4 * 1024
"""Room for the beginning of a picture."""


@pytest.fixture
def disk(settings: LazySettings, tmp_path: Path) -> Iterator[Path]:
    """The folder of the pictures, on a disk of its own."""
    folder = tmp_path / "media"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={BYTES}", "arena", str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    if mounted.returncode:
        reason = f"no disk can be mounted here: {mounted.stderr.strip()}"
        if os.environ.get("CI"):
            pytest.fail(f"{reason}, and in CI nothing is skipped")
        pytest.skip(reason)
    settings.MEDIA_ROOT = folder
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_fails_the_row_and_a_retry_asks_nobody_again(disk: Path) -> None:
    row = llama_job().augmentations.select_related("scenario__base_scene").get()
    original_picture(row.scenario)
    filler = _fill(disk)
    before = _files(disk)

    ran(row, Wire(GOOD))
    assert row.state == State.FAILED
    assert "No space left on device" in row.reason
    assert row.modification is not None, "what was answered is kept"
    assert _files(disk) == before, "no half of a picture"
    assert ModelCall.objects.count() == 1

    filler.unlink()
    jobs.retry_failed(row.job)
    ran(row, Wire())
    assert row.state == State.DONE
    assert (disk / row.image).read_bytes().endswith(b"IEND\xaeB`\x82")
    assert ModelCall.objects.count() == 1, "nothing was paid twice"


def _fill(disk: Path) -> Path:
    """Write until there is no more room, then leave a little."""
    filler = disk / "filler"
    with filler.open("wb", buffering=0) as file:
        written = 0
        try:
            while True:
                written += file.write(b"x" * LEFT)
        except OSError:
            file.truncate(written - LEFT)
    return filler


def _files(disk: Path) -> dict[str, int]:
    return {
        str(path.relative_to(disk)): path.stat().st_size
        for path in disk.rglob("*")
        if path.is_file()
    }
