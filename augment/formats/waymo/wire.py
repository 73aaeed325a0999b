"""Protocol-buffer messages as lists of their fields, read by the published wire format.

Strict: what is cut off, has a field number 0, a group or a number of more than 64 bits is refused.
What a field means is known to `messages`; fields that nobody asks for are passed over.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from augment.errors import InvalidDocument
from augment.formats.waymo.tfrecord import WHAT

Value = int | float | bytes
"""A number of a varint, the bytes of a fixed field as their float, or a block."""

_DOUBLE = struct.Struct("<d")
_FLOAT = struct.Struct("<f")


def read_fields(block: bytes) -> Iterator[tuple[int, Value]]:
    """Each field's number and value, in the message's order.

    Raises:
        InvalidDocument: The block is no message.
    """
    place, end = 0, len(block)
    while place < end:
        key = block[place]
        place += 1
        if key & 0x80:
            key, place = _varint(block, place - 1)
        kind, number = key & 7, key >> 3
        if number == 0:
            raise _broken("a field has the number 0")
        if kind == 0:
            value, place = _varint(block, place)
            yield number, value
        elif kind == 2:
            length, place = _varint(block, place)
            if place + length > end:
                raise _broken(f"field {number} is longer than its message")
            yield number, block[place : place + length]
            place += length
        elif kind == 1 and place + 8 <= end:
            yield number, _DOUBLE.unpack_from(block, place)[0]
            place += 8
        elif kind == 5 and place + 4 <= end:
            yield number, _FLOAT.unpack_from(block, place)[0]
            place += 4
        else:
            raise _broken(f"field {number} is cut off or of the kind {kind}")


def whole_of(value: Value) -> int:
    """A varint as the signed 64-bit number that it is.

    Raises:
        InvalidDocument: The field is of another kind.
    """
    if not isinstance(value, int):
        raise _broken(f"expected a whole number, got {type(value).__name__}")
    return value - (1 << 64) if value >> 63 else value


def real_of(value: Value) -> float:
    """A float or double.

    Raises:
        InvalidDocument: The field is of another kind.
    """
    if not isinstance(value, float):
        raise _broken(f"expected a float or double, got {type(value).__name__}")
    return value


def block_of(value: Value) -> bytes:
    """A message, text or packed list.

    Raises:
        InvalidDocument: The field is of another kind.
    """
    if not isinstance(value, bytes):
        raise _broken(f"expected a message, got {type(value).__name__}")
    return value


def wholes_of(value: Value) -> list[int]:
    """A repeated whole number: packed, or one of several fields."""
    if isinstance(value, int):
        return [whole_of(value)]
    block, place, found = block_of(value), 0, []
    while place < len(block):
        number, place = _varint(block, place)
        found.append(whole_of(number))
    return found


def reals_of(value: Value) -> list[float]:
    """A repeated double: packed, or one of several fields."""
    if isinstance(value, float):
        return [value]
    block = block_of(value)
    if len(block) % 8:
        raise _broken("a list of doubles is cut off")
    return [one[0] for one in _DOUBLE.iter_unpack(block)]


# Private


def _varint(block: bytes, place: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        if place >= len(block):
            raise _broken("a number is cut off")
        byte = block[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            if value >> 64:
                raise _broken("a number has more than 64 bits")
            return value, place
        shift += 7
        if shift > 63:
            raise _broken("a number has more than 64 bits")


def _broken(text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [("message", text)])
