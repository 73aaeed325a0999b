"""Thrift's compact protocol, as far as the page headers of Parquet go: structs of numbers."""

from __future__ import annotations

from typing import Any

DEEPEST = 8
MOST_FIELDS = 64
_TRUE, _FALSE, _BYTE, _I16, _I32, _I64, _DOUBLE, _BINARY, _LIST, _SET, _MAP, _STRUCT = range(1, 13)


class Truncated(Exception):
    """The bytes end in the middle, or are no struct."""


def read_struct(block: bytes, place: int, depth: int = 0) -> tuple[dict[int, Any], int]:
    """The fields of a struct by their number, and where it ends.

    Whole numbers, truths and structs are kept; of what else there is, nothing.

    Raises:
        Truncated: There is no struct.
    """
    if depth > DEEPEST:
        raise Truncated("a page header is nested too deeply")
    fields: dict[int, Any] = {}
    number = 0
    for _ in range(MOST_FIELDS):
        head, place = _byte(block, place)
        if head == 0:
            return fields, place
        step, kind = head >> 4, head & 0x0F
        if step:
            number += step
        else:
            number, place = _zigzag(block, place)
        value, place = _value(block, place, kind, depth)
        if value is not None:
            fields[number] = value
    raise Truncated("a page header has too many fields")


# Private


def _value(block: bytes, place: int, kind: int, depth: int) -> tuple[Any, int]:
    if kind in (_TRUE, _FALSE):
        return kind == _TRUE, place
    if kind == _BYTE:
        return _byte(block, place)
    if kind in (_I16, _I32, _I64):
        return _zigzag(block, place)
    if kind == _DOUBLE:
        return None, place + 8
    if kind == _BINARY:
        length, place = _varint(block, place)
        return None, place + length
    if kind == _STRUCT:
        return read_struct(block, place, depth + 1)
    raise Truncated(f"a page header has a field of kind {kind}")


def _byte(block: bytes, place: int) -> tuple[int, int]:
    if not 0 <= place < len(block):
        raise Truncated("a page header is cut off")
    return block[place], place + 1


def _varint(block: bytes, place: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        part, place = _byte(block, place)
        value |= (part & 0x7F) << shift
        if part < 0x80:
            return value, place
    raise Truncated("a page header has a number without an end")


def _zigzag(block: bytes, place: int) -> tuple[int, int]:
    value, place = _varint(block, place)
    return (value >> 1) ^ -(value & 1), place
