"""Records of a TFRecord file, one after the other, each with its checksum checked.

A record is its length (8 bytes, little endian), the length's checksum (4), the payload and the
payload's checksum (4).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import google_crc32c

from augment.errors import InvalidDocument

WHAT = "Waymo Open Motion file"

_HEAD = struct.Struct("<QI")
_FOOT = struct.Struct("<I")


def read_records(path: Path, *, only: int | None = None) -> Iterator[tuple[int, bytes]]:
    """Each record's number and payload.

    Args:
        path: The file.
        only: The number of the one that is wanted: what lies before it is passed over unread.

    Raises:
        InvalidDocument: A length, a checksum or the end of the file is wrong.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(0)
            yield from _records(path.name, file, size, only)
    except OSError as fault:
        raise InvalidDocument(WHAT, [(str(path), fault.strerror or str(fault))]) from None


def starts_a_record(path: Path) -> bool:
    """Whether the file begins with a length that has the right checksum."""
    with path.open("rb") as file:
        head = file.read(_HEAD.size)
    return len(head) == _HEAD.size and masked_crc32c(head[:8]) == _HEAD.unpack(head)[1]


def masked_crc32c(block: bytes) -> int:
    """What stands in the file beside a block: its CRC-32C, rotated and shifted."""
    crc: int = google_crc32c.value(block)
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF


# Private


def _records(
    name: str, file: BinaryIO, size: int, only: int | None
) -> Iterator[tuple[int, bytes]]:
    number, place = 0, 0
    while place < size:
        head = file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise _fault(name, number, "is cut off in its length")
        length, check = _HEAD.unpack(head)
        if masked_crc32c(head[:8]) != check:
            raise _fault(name, number, "has a length with a wrong checksum")
        end = place + _HEAD.size + length + _FOOT.size
        if end > size:
            missing = end - size
            raise _fault(name, number, f"is cut off: {missing} bytes of it are missing")
        if only is None or number == only:
            payload = file.read(length)
            (check,) = _FOOT.unpack(file.read(_FOOT.size))
            if masked_crc32c(payload) != check:
                raise _fault(name, number, "has a payload with a wrong checksum")
            yield number, payload
            if only is not None:
                return
        place = end
        file.seek(place)
        number += 1


def _fault(name: str, number: int, text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [(f"{name}: record {number}", text)])
