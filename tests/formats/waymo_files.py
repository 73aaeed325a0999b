"""Small Waymo Open Motion files, written by the published wire format with `struct` alone."""

import struct
from pathlib import Path

from augment.formats.waymo.scenario import mask_crc32c

Fields = list[tuple[int, object]]


def varint(number: int) -> bytes:
    number &= (1 << 64) - 1
    made = bytearray()
    while number > 0x7F:
        made.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*made, number])


class Single(float):
    """A number of four bytes."""


def message(*fields: tuple[int, object]) -> bytes:
    made = b""
    for number, value in fields:
        if isinstance(value, Single):
            made += varint(number << 3 | 5) + struct.pack("<f", value)
        elif isinstance(value, float):
            made += varint(number << 3 | 1) + struct.pack("<d", value)
        elif isinstance(value, int):
            made += varint(number << 3) + varint(value)
        elif isinstance(value, bytes):
            made += varint(number << 3 | 2) + varint(len(value)) + value
    return made


def points(number: int, *pairs: tuple[float, float]) -> Fields:
    return [(number, message((1, float(x)), (2, float(y)), (3, 0.0))) for x, y in pairs]


def state(x: float, y: float, heading: float, speed: float, *, valid: bool = True) -> bytes:
    return message(
        *((2, float(x)), (3, float(y)), (5, Single(4.5)), (6, Single(2.0))),
        *((8, Single(heading)), (9, Single(speed)), (10, Single(0.0)), (11, int(valid))),
    )


def track(number: int, kind: int, *states: bytes) -> tuple[int, bytes]:
    return 2, message((1, number), (2, kind), *((3, one) for one in states))


def lane(number: int, *fields: tuple[int, object]) -> tuple[int, bytes]:
    return 8, message((1, number), (3, message(*fields)))


def scenario(*more: tuple[int, object], steps: int = 3, ego: int = 0) -> bytes:
    """The ego drives east at 10 m/s from (1000, 500); a car stands 20 m ahead of its start.

    Lane 1 ends at x = 1030, where lanes 2 (on, with a light) and 3 (left) begin; line 9 bounds
    lane 1 on its left and 8 on its right.
    """
    left = (13, message((1, 0), (2, 1), (3, 9), (4, 1)))
    right = (14, message((1, 0), (2, 1), (3, 8), (4, 1)))
    street = [(1, 25.0), (2, 2), *points(8, (980, 500), (1030, 500)), (10, varint(2) + varint(3))]
    onward = [(2, 2), *points(8, (1030, 500), (1060, 500)), (9, varint(1)), (10, varint(4))]
    bend = [(2, 2), *points(8, (1030, 500), (1040, 503), (1043, 515)), (9, varint(1)), (3, 1)]
    return message(
        *((1, 0.1 * step) for step in range(steps)),
        track(7, 1, *(state(1000 + step, 500, 0.0, 10.0) for step in range(steps))),
        track(8, 1, *(state(1021, 500, 0.0, 0.0) for _ in range(steps))),
        (5, b"made"),
        (6, ego),
        *((7, message((1, message((1, 2), (2, 6 if step < 2 else 4))))) for step in range(steps)),
        lane(1, *street, left, right),
        lane(2, *onward, (3, 1)),
        lane(3, *bend),
        lane(4, (2, 2), *points(8, (1060, 500), (1090, 500))),
        (8, message((1, 9), (4, message((1, 2), *points(2, (970, 502), (1040, 502)))))),
        (8, message((1, 8), (5, message((1, 1), *points(2, (970, 498), (1040, 498)))))),
        (8, message((1, 20), (8, message(*points(1, (1010, 495), (1013, 495), (1013, 505)))))),
        (10, 1),
        *more,
    )


def record(payload: bytes) -> bytes:
    head = struct.pack("<Q", len(payload))
    return b"".join(part + struct.pack("<I", mask_crc32c(part)) for part in (head, payload))


def write(path: Path, *payloads: bytes) -> Path:
    path.write_bytes(b"".join(record(payload) for payload in payloads))
    return path
