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

from augment.foreign import fault_at

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
    """A numpy array or number, by its shape, kind and bytes."""

    __slots__ = ("value",)

    def __init__(self, *_: Any) -> None:
        self.value: Any = np.zeros(0)

    def __setstate__(self, state: Any) -> None:
        _, shape, kind, is_column_wise, block = state
        self.fill(block, kind, shape, "F" if is_column_wise else "C")

    def fill(self, block: Any, kind: Any, shape: Any, order: Any) -> _Array:
        if not isinstance(kind, _Kind):
            raise TypeError("an array needs its kind")
        if "O" not in kind.name:
            block = block.encode("latin1") if isinstance(block, str) else bytes(block)
            self.value = np.frombuffer(block, dtype=kind.name).reshape(shape, order=order)
        elif isinstance(block, list):
            self.value = list(block)
        else:
            raise TypeError("an array of objects needs a list")
        return self


def _enum_number(value: Any) -> Any:
    """Return the number of an enumeration's member, which stands for it."""
    if not isinstance(value, int):
        raise TypeError("a member of an enumeration needs its number")
    return value


def _encode(text: str, coding: str = "latin1") -> bytes:
    """Encode bytes, which older protocols write as text."""
    if coding not in ("latin1", "latin-1"):
        raise ValueError(f"bytes in the coding {coding[:20]!r} are not read")
    return text.encode("latin1")


_ALLOWED: dict[str, Any] = {  # None: a name that is only ever handed on
    "numpy.ndarray": None,
    "numpy.dtype": _Kind,
    "collections.defaultdict": lambda *_: {},  # its default is dropped
    "collections.OrderedDict": lambda *_: {},
    "builtins.int": None,
    "builtins.set": set,
    "__builtin__.int": None,
    "__builtin__.long": None,
    "__builtin__.set": set,
    "_codecs.encode": _encode,
    **{
        f"trafficgen.utils.typedef.{kind}": _enum_number  # in LCTGen's pickles
        for kind in ("AgentType", "RoadLineType", "RoadEdgeType")
    },
    "numpy.core.multiarray._reconstruct": _Array,
    "numpy.core.multiarray.scalar": lambda kind, block: (
        _Array().fill(block, kind, (), "C").value.item()
    ),
    "numpy.core.numeric._frombuffer": lambda block, kind, shape, order: _Array().fill(
        block, kind, shape, order if order == "F" else "C"
    ),
}
"""Version 2 of numpy calls its `core` `_core`."""


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        place = f"{module}.{name}"
        if place.replace("numpy._core.", "numpy.core.") not in _ALLOWED:
            raise pickle.UnpicklingError(f"{place} is not on the list")
        return _ALLOWED[place.replace("numpy._core.", "numpy.core.")]


def read_pickle(path: Path) -> Any:
    """Return the file's content: dictionaries, lists, texts, numbers, numpy arrays.

    Raises:
        InvalidDocument: The file is no pickle, or names what is not on the list.
    """
    try:
        return _plain(_Unpickler(io.BytesIO(path.read_bytes()), encoding="latin1").load())
    except (OSError, *_FAULTS) as fault:
        raise fault_at(path.name, f"can't be unpickled safely: {str(fault)[:200]}") from None


def _plain(value: Any) -> Any:
    """The value with arrays in the place of what stood for them."""
    if isinstance(value, _Array):
        return _plain(value.value)
    if isinstance(value, dict):
        texts = (
            (str(key) if isinstance(key, tuple) else key, part) for key, part in value.items()
        )
        return {_plain(key): _plain(part) for key, part in texts}
    if isinstance(value, list | tuple | set):
        return [_plain(part) for part in value]
    if value is None or isinstance(value, str | bytes | int | float | np.ndarray):
        return value
    raise ValueError(f"holds a {type(value).__name__.strip('_')}, which is no plain value")
