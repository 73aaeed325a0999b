"""A pickle as plain values and arrays, without running anything that it names.

A pickle is a program. Two things make it harmless here: what it may name is a list, and each name
stands for something of ours that only remembers its arguments; arrays are made from the remembered
bytes afterwards, so numpy's own unpickling never runs. How long it may run and what it may take is
the reading process's affair (`sandbox`).
"""

from __future__ import annotations

import io
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np

from augment.errors import InvalidDocument

WHAT = "ScenarioNet file"

_KIND = re.compile(r"[<>=|]?(?:[?]|[biuf](?:1|2|4|8)|[US][0-9]{1,4}|b1|O|O8)")
_FAULTS = (
    *(pickle.UnpicklingError, EOFError, ValueError, TypeError, KeyError, IndexError),
    *(AttributeError, OverflowError, NotImplementedError),
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
        InvalidDocument: The file is no pickle, or names what is not on the list.
    """
    try:
        block = path.read_bytes()
    except OSError as fault:
        raise _fault(path, fault.strerror or str(fault)) from None
    try:
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


def _plain(value: Any) -> Any:
    """The value with arrays in the place of what stood for them."""
    if isinstance(value, _Array | _Scalar):
        return _plain(value.value)
    if isinstance(value, dict):
        return {_plain(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple | set):
        return [_plain(one) for one in value]
    if value is None or isinstance(value, str | bytes | int | float | np.ndarray):
        return value
    raise ValueError(f"holds a {type(value).__name__.strip('_')}, which is no plain value")


def _fault(path: Path, text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [(path.name, text)])
