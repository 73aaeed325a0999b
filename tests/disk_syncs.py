"""How often SQLite has files written through to the disk, counted where it asks the system to.

SQLite reaches files through a table of functions that a program may exchange (a "VFS",
https://www.sqlite.org/vfs.html). Ours passes everything on and counts the calls of xSync. It is
laid around the library that Python's own sqlite3 uses, so nothing need be compiled or traced.
"""

import _sqlite3
import ctypes
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import CFUNCTYPE, POINTER, byref, c_char_p, c_int, c_void_p, cast, sizeof
from typing import Any

_POINTER_BYTES = sizeof(c_void_p)
_METHODS = {1: 12, 2: 16, 3: 18}
"""How many functions a table of a file has, by its version."""

_SYNC_PLACE = 5
"""Where xSync stands in it, behind the version, xClose, xRead, xWrite and xTruncate."""

_OPEN = CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(c_void_p), c_int, c_void_p)
_SYNC = CFUNCTYPE(c_int, c_void_p, c_int)


class _Vfs(ctypes.Structure):
    _fields_ = [
        *(("version", c_int), ("file_bytes", c_int), ("longest_path", c_int)),
        *(("next", c_void_p), ("name", c_char_p), ("data", c_void_p), ("open", c_void_p)),
        ("others", c_void_p * 15),
    ]


class NotReachable(Exception):
    """Python's SQLite is built in so that its functions can't be called."""


def _library() -> Any:
    try:
        library = ctypes.CDLL(_sqlite3.__file__)
        library.sqlite3_vfs_find.restype = POINTER(_Vfs)
    except (AttributeError, OSError) as error:
        raise NotReachable(str(error)) from error
    return library


@contextmanager
def counted_syncs() -> Iterator[Counter[str]]:
    """By path, how often a file was written through; of connections that are opened meanwhile.

    Close them before the end.

    Raises:
        NotReachable: This Python does not let it be counted.
    """
    library = _library()
    plain = library.sqlite3_vfs_find(None)
    open_plainly = cast(plain.contents.open, _OPEN)
    seen: Counter[str] = Counter()
    paths: dict[int, str] = {}
    kept: dict[int, Any] = {}  # what SQLite points at

    def counting(methods: int) -> None:
        """Keep a copy of a file's table with another xSync."""
        count = 1 + _METHODS[min(c_int.from_address(methods).value, 3)]
        table = (c_void_p * count).from_buffer_copy(
            ctypes.string_at(methods, count * _POINTER_BYTES)
        )
        sync_plainly = cast(c_void_p(table[_SYNC_PLACE]), _SYNC)

        def sync(file: int, flags: int) -> int:
            seen[paths.get(file, "")] += 1
            return int(sync_plainly(file, flags))

        counted = _SYNC(sync)
        table[_SYNC_PLACE] = cast(counted, c_void_p).value
        kept[methods] = (table, counted)

    # SQLite keeps the address of the path, so that is what is passed on, never a copy.
    def open_file(_: int, path: int | None, file: Any, flags: int, out: int) -> int:
        result = int(open_plainly(cast(plain, c_void_p), path, file, flags, out))
        methods = file[0]
        if methods:
            if methods not in kept:
                counting(methods)
            paths[cast(file, c_void_p).value or 0] = (
                ctypes.string_at(path).decode() if path else ""
            )
            file[0] = ctypes.addressof(kept[methods][0])
        return result

    ours = _Vfs.from_buffer_copy(plain.contents)
    opening = _OPEN(open_file)
    ours.name, ours.open = b"counted", cast(opening, c_void_p)
    library.sqlite3_vfs_register(byref(ours), 1)
    try:
        yield seen
    finally:
        library.sqlite3_vfs_unregister(byref(ours))
        library.sqlite3_vfs_register(plain, 1)
