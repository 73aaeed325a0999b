"""Zips from strangers: unpacked whole within bounds, or refused in a sentence."""

import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from augment.errors import InvalidDocument
from augment.formats.apart import ZipBounds, unpack_zip
from augment.formats.readers import READERS, find_input
from tests.formats.av2_logs import write_log

SMALL = ZipBounds(entries=20, bytes=3_000_000)


def packed(path: Path, files: dict[str, bytes], *, kind: int = stat.S_IFREG) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (kind | 0o644) << 16
            made.writestr(entry, content)
    return path


def folder_as_zip(path: Path, folder: Path) -> Path:
    with zipfile.ZipFile(path, "w") as made:
        for file in sorted(folder.rglob("*")):
            made.write(file, file.relative_to(folder.parent))
    return path


def test_a_log_folder_comes_out_as_it_went_in(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log")
    into = tmp_path / "into"
    into.mkdir()
    unpack_zip(folder_as_zip(tmp_path / "log.zip", log), into)
    reader, path = find_input(into, list(READERS.values()), is_deep=True)
    assert (reader.name, path) == ("av2", into / "log")
    for file in (one for one in log.rglob("*") if one.is_file()):
        assert (into / "log" / file.relative_to(log)).read_bytes() == file.read_bytes()


DEEP = "a/" * 900 + "b"
NAMES = ["../out", "/etc/passwd", "a/../../out", "c:\\out", "a\\b", "a:b", "a\nb", ".", DEEP]


@pytest.mark.parametrize("name", NAMES)
def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    refuse(tmp_path, packed(tmp_path / "z.zip", {"fine": b"1", name: b"2"}), "no name within")


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda p: packed(p, {f"{n}": b"1" for n in range(21)}), "holds 21 files"),
        (lambda p: packed(p, {f"{n}": bytes(200_000) for n in range(16)}), "of 3200000 bytes"),
        (lambda p: packed(p, {"link": b"/etc/passwd"}, kind=stat.S_IFLNK), "link or a special"),
        (lambda p: packed(p, {"pipe": b""}, kind=stat.S_IFIFO), "link or a special"),
        (lambda p: packed(p, {"a": b"1", "./a": b"2"}), "is there twice"),
        (lambda p: packed(p, {"a": b"1", "a/b": b"2"}), "lies in a file"),
        (lambda p: packed(p, {"x" * 300: b"1"}), "File name too long"),
        (lambda p: packed(p, {}), "holds 0 files"),
        (lambda p: cut(packed(p, {"a": bytes(range(256)) * 50})), "is broken"),
        (lambda p: packed_as(p, zipfile.ZIP_LZMA), "packed in another way"),
        (lambda p: scrambled(p), "is broken"),
        (lambda p: flagged(packed(p, {"a": b"hello"}), 0x01), "is encrypted"),
        (lambda p: flagged(packed(p, {"a": b"hello"}), 0x20), "is broken: compressed patched"),
    ],
)
def test_what_breaks_the_rules_is_refused(
    tmp_path: Path, make: Callable[[Path], Path], problem: str
) -> None:
    refuse(tmp_path, make(tmp_path / "z.zip"), problem)


def refuse(tmp_path: Path, path: Path, problem: str) -> None:
    into = tmp_path / "deep" / "into"
    into.mkdir(parents=True)
    with pytest.raises(InvalidDocument, match=problem):
        unpack_zip(path, into, bounds=SMALL)
    outside = {one.name for one in (tmp_path / "deep").iterdir()} | {
        one.name for one in tmp_path.iterdir()
    }
    assert outside == {"into", "deep", "z.zip"}


def cut(path: Path) -> Path:
    path.write_bytes(path.read_bytes()[:-30])
    return path


def packed_as(path: Path, kind: int) -> Path:
    with zipfile.ZipFile(path, "w", kind) as made:
        made.writestr("a", bytes(range(256)) * 400)
    return path


def scrambled(path: Path) -> Path:
    """Broken where its bytes lie."""
    data = bytearray(packed_as(path, zipfile.ZIP_DEFLATED).read_bytes())
    data[45:80] = bytes(byte ^ 0xFF for byte in data[45:80])
    path.write_bytes(data)
    return path


def flagged(path: Path, bit: int) -> Path:
    data = bytearray(path.read_bytes())
    data[data.index(b"PK\x01\x02") + 8] |= bit
    path.write_bytes(data)
    return path


def test_several_recordings_are_named_and_nothing_is_chosen(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write_log(tmp_path / "into" / name)
    with pytest.raises(InvalidDocument, match=r"into/one \(av2\), into/two \(av2\)"):
        find_input(tmp_path / "into", list(READERS.values()), is_deep=True)
