"""The checksum of TFRecords: CRC-32C (Castagnoli), rotated and shifted.

A block is taken as many equal rows that are worked through side by side, a byte of each at a
time, and joined at the end: a shift past a row of zeros is linear, so four tables do it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_POLYNOMIAL = 0x82F63B78
_MASK_DELTA = 0xA282EAD8
_ROW = 1024


def masked_crc32c(block: bytes) -> int:
    """What a TFRecord has beside the block."""
    crc = crc32c(block)
    return (((crc >> 15) | (crc << 17)) + _MASK_DELTA) & 0xFFFFFFFF


def crc32c(block: bytes) -> int:
    """The CRC-32C of a block."""
    rows = len(block) // _ROW
    state = 0xFFFFFFFF
    if rows > 1:
        columns = np.frombuffer(block, dtype=np.uint8, count=rows * _ROW).reshape(rows, _ROW).T
        states = np.zeros(rows, dtype=np.uint32)
        states[0] = state
        for column in np.ascontiguousarray(columns):
            states = _TABLE[(states ^ column) & 0xFF] ^ (states >> 8)
        state = 0
        for one in states.tolist():
            state = _past_row(state) ^ one
        block = block[rows * _ROW :]
    for byte in block:
        state = _BYTES[(state ^ byte) & 0xFF] ^ (state >> 8)
    return state ^ 0xFFFFFFFF


# Private


def _table() -> NDArray[np.uint32]:
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ np.uint32(_POLYNOMIAL), table >> 1)
    return table.astype(np.uint32)


_TABLE = _table()
_BYTES: list[int] = _TABLE.tolist()


def _past_zeros(state: int) -> int:
    for _ in range(_ROW):
        state = _BYTES[state & 0xFF] ^ (state >> 8)
    return state


def _shift_tables() -> list[list[int]]:
    """What each byte of a state becomes past a row of zeros."""
    bits = [_past_zeros(1 << bit) for bit in range(32)]
    tables = []
    for place in range(4):
        table = [0] * 256
        for value in range(1, 256):
            low = value & -value
            table[value] = table[value ^ low] ^ bits[8 * place + low.bit_length() - 1]
        tables.append(table)
    return tables


_SHIFT = _shift_tables()


def _past_row(state: int) -> int:
    first, second, third, fourth = _SHIFT
    return (
        first[state & 0xFF]
        ^ second[(state >> 8) & 0xFF]
        ^ third[(state >> 16) & 0xFF]
        ^ fourth[state >> 24]
    )
