"""A pickle as plain values and arrays, without running anything that it names.

A pickle is a program. Three things make it harmless here: its instructions are looked through
before one of them runs (only those on a list, no place in its memory beyond their number); what it
may name is a list, and each name stands for something of ours that only remembers its arguments;
arrays are made from the remembered bytes afterwards, so numpy's own unpickling never runs.
"""

from __future__ import annotations

import io
import pickle
import pickletools
import re
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from augment.errors import InvalidDocument

WHAT = "ScenarioNet file"
MOST_BYTES = 64 * 1024 * 1024
MOST_INSTRUCTIONS = 400_000
MOST_VALUES = 2_000_000
"""What is written once can be referred to a thousand times."""

_INSTRUCTIONS = frozenset(
    [
        "PROTO",
        "FRAME",
        "STOP",
        "MARK",
        "POP",
        "POP_MARK",
        "DUP",
        "NONE",
        "NEWTRUE",
        "NEWFALSE",
        "INT",
        "BININT",
        "BININT1",
        "BININT2",
        "LONG",
        "LONG1",
        "LONG4",
        "FLOAT",
        "BINFLOAT",
        "STRING",
        "BINSTRING",
        "SHORT_BINSTRING",
        "BINBYTES",
        "SHORT_BINBYTES",
        "BINBYTES8",
        "BYTEARRAY8",
        "UNICODE",
        "SHORT_BINUNICODE",
        "BINUNICODE",
        "BINUNICODE8",
        "EMPTY_LIST",
        "LIST",
        "APPEND",
        "APPENDS",
        "EMPTY_TUPLE",
        "TUPLE",
        "TUPLE1",
        "TUPLE2",
        "TUPLE3",
        "EMPTY_DICT",
        "DICT",
        "SETITEM",
        "SETITEMS",
        "EMPTY_SET",
        "ADDITEMS",
        "GLOBAL",
        "STACK_GLOBAL",
        "REDUCE",
        "BUILD",
        "PUT",
        "BINPUT",
        "LONG_BINPUT",
        "MEMOIZE",
        "GET",
        "BINGET",
        "LONG_BINGET",
    ]
)
_MEMORY = frozenset(("PUT", "BINPUT", "LONG_BINPUT"))
_KIND = re.compile(r"[<>=|]?(?:[?]|[biuf](?:1|2|4|8)|[US][0-9]{1,4}|b1|O|O8)")
_FAULTS = (
    *(pickle.UnpicklingError, EOFError, ValueError, TypeError, KeyError, IndexError),
    *(AttributeError, OverflowError, MemoryError, RecursionError, NotImplementedError),
)


class _Kind:
    """A numpy dtype, by its name."""

    __slots__ = ("name",)

    def __init__(self, name: Any, *_: Any) -> None:
        if not isinstance(name, str) or not _KIND.fullmatch(name):
            raise ValueError(f"arrays of the kind {str(name)[:20]!r} are not read")
        self.name = name

    def __setstate__(self, state: Any) -> None:
        order, described = state[1], state[2:5]
        if order not in ("<", ">", "=", "|") or any(part is not None for part in described):
            raise ValueError("arrays of records are not read")
        self.name = order + self.name.lstrip("<>=|")


class _Array:
    """A numpy array, by its shape, kind and bytes."""

    __slots__ = ("value",)

    def __init__(self, *_: Any) -> None:
        self.value: Any = np.zeros(0)

    def __setstate__(self, state: Any) -> None:
        _, shape, kind, is_column_wise, block = state
        self.value = _filled(block, kind, shape, "F" if is_column_wise else "C")


class _Scalar:
    """A numpy number."""

    __slots__ = ("value",)

    def __init__(self, kind: Any, block: Any) -> None:
        self.value = _filled(_as_bytes(block), kind, (), "C").item()


class _Buffer(_Array):
    """A numpy array in the form of newer protocols."""

    __slots__ = ()

    def __init__(self, block: Any, kind: Any, shape: Any, order: Any) -> None:
        self.value = _filled(bytes(block), kind, shape, "F" if order == "F" else "C")


class _Named:
    """Something that is only ever handed on."""

    __slots__ = ()


class _Encode:
    """How older protocols write bytes: as text."""

    __slots__ = ()

    def __call__(self, text: str, coding: str = "latin1") -> bytes:
        if coding not in ("latin1", "latin-1"):
            raise ValueError(f"bytes in the coding {coding[:20]!r} are not read")
        return text.encode("latin1")


class _Counting:
    """A dictionary with a default, which is dropped."""

    __slots__ = ()

    def __call__(self, *_: Any) -> dict[Any, Any]:
        return {}


_ALLOWED: dict[tuple[str, str], Any] = {
    ("numpy", "ndarray"): _Named(),
    ("numpy", "dtype"): _Kind,
    ("collections", "defaultdict"): _Counting(),
    ("collections", "OrderedDict"): _Counting(),
    ("builtins", "int"): _Named(),
    ("builtins", "set"): set,
    ("__builtin__", "int"): _Named(),
    ("__builtin__", "long"): _Named(),
    ("__builtin__", "set"): set,
    ("_codecs", "encode"): _Encode(),
} | {
    (module.replace("core", core), name): stand_in
    for core in ("core", "_core")
    for (module, name), stand_in in {
        ("numpy.core.multiarray", "_reconstruct"): _Array,
        ("numpy.core.multiarray", "scalar"): _Scalar,
        ("numpy.core.numeric", "_frombuffer"): _Buffer,
    }.items()
}


def read_pickle(path: Path) -> Any:
    """What the file holds: dictionaries, lists, texts, numbers, numpy arrays.

    Raises:
        InvalidDocument: The file is too large, is no pickle, or names what is not on the list.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise _fault(path, f"is larger than {MOST_BYTES} bytes")
        block = path.read_bytes()
    except OSError as fault:
        raise _fault(path, fault.strerror or str(fault)) from None
    try:
        _look_through(block)
        return _plain(_Unpickler(io.BytesIO(block), encoding="latin1").load())
    except _FAULTS as fault:
        raise _fault(path, f"can't be unpickled safely: {str(fault)[:200]}") from None


# Private


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        try:
            return _ALLOWED[module, name]
        except KeyError:
            raise pickle.UnpicklingError(f"{module}.{name} is not on the list") from None


def _look_through(block: bytes) -> None:
    """Raises ValueError for an instruction that is not on the list, and for a huge memory."""
    for number, (instruction, argument, _) in enumerate(pickletools.genops(block)):
        if instruction.name not in _INSTRUCTIONS:
            raise ValueError(f"the instruction {instruction.name} is not on the list")
        if number > MOST_INSTRUCTIONS:
            raise ValueError(f"more than {MOST_INSTRUCTIONS} instructions")
        if instruction.name in _MEMORY and int(argument or 0) > MOST_INSTRUCTIONS:
            raise ValueError(f"place {str(argument)[:20]} of its memory is too far")


def _filled(block: Any, kind: Any, shape: Any, order: Any) -> Any:
    if not isinstance(kind, _Kind):
        raise TypeError("an array needs its kind")
    sizes = tuple(shape)
    if any(not isinstance(size, int) or size < 0 for size in sizes):
        raise ValueError("an array needs a shape")
    if "O" in kind.name:
        if not isinstance(block, list):
            raise TypeError("an array of objects needs a list")
        return list(block)
    return np.frombuffer(_as_bytes(block), dtype=kind.name).reshape(sizes, order=order)


def _as_bytes(block: Any) -> bytes:
    return block.encode("latin1") if isinstance(block, str) else bytes(block)


def _plain(value: Any, depth: int = 0, counted: Iterator[int] | None = None) -> Any:
    """The value with arrays in the place of what stood for them."""
    if depth > 12:
        raise ValueError("is more than 12 levels deep")
    counted = counted or count(1)
    if next(counted) > MOST_VALUES:
        raise ValueError(f"has more than {MOST_VALUES} values")
    if isinstance(value, _Array | _Scalar):
        return _plain(value.value, depth + 1, counted)
    if isinstance(value, dict):
        return {
            _plain(key, depth + 1, counted): _plain(one, depth + 1, counted)
            for key, one in value.items()
        }
    if isinstance(value, list | tuple | set):
        return [_plain(one, depth + 1, counted) for one in value]
    if value is None or isinstance(value, str | bytes | int | float | np.ndarray):
        return value
    raise ValueError(f"holds a {type(value).__name__.strip('_')}, which is no plain value")


def _fault(path: Path, text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [(path.name, text)])
