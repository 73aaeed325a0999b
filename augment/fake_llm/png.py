"""Whether bytes are a whole picture: every chunk intact, every row there."""

from __future__ import annotations

import struct
import zlib

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_MOST_PIXELS = 16_000_000


def size_of(png: bytes) -> tuple[int, int]:
    """Width and height in pixels of a PNG that can be decoded to its last row.

    Raises:
        ValueError: It can't be; the text says why.
    """
    if not png.startswith(_SIGNATURE):
        raise ValueError("the image is not a PNG")
    try:
        header, packed = _chunks(png)
        width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
        if not 0 < width * height <= _MOST_PIXELS or colour not in _CHANNELS or interlaced:
            raise ValueError("the PNG has a form that is not taken")
        row = 1 + (width * depth * _CHANNELS[colour] + 7) // 8
        rows = zlib.decompressobj().decompress(packed, row * height + 1)
    except (struct.error, zlib.error):
        raise ValueError("the PNG is damaged") from None
    if len(rows) != row * height or max(rows[::row]) > 4:
        raise ValueError("the PNG lacks rows or has too many")
    return width, height


def _chunks(png: bytes) -> tuple[bytes, bytes]:
    """The header and the packed rows; every checksum is looked at."""
    header, packed, at = b"", b"", len(_SIGNATURE)
    while True:
        length, kind = struct.unpack_from(">I4s", png, at)
        data = png[at + 8 : at + 8 + length]
        (checksum,) = struct.unpack_from(">I", png, at + 8 + length)
        if checksum != zlib.crc32(kind + data):
            raise ValueError("a checksum of the PNG is wrong")
        if kind == b"IEND":
            return header, packed
        header = data if kind == b"IHDR" else header
        packed += data if kind == b"IDAT" else b""
        at += 12 + length
