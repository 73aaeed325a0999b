"""One vocabulary for values from elsewhere: absent, understood, or not understood.

A border (the wire, a reader of files) takes each value of a foreign document through here. None
stands for absent and for not understood alike, but the latter always leaves a note, so that no
default takes its place unseen. Pure.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeVar

_KINDS = {bool: "a boolean", int: "a number", float: "a number", str: "a text", list: "a list"}
_Value = TypeVar("_Value")


def kind_of(value: object) -> str:
    """Return what a value of JSON is, in words."""
    return _KINDS.get(type(value), "an object")


@dataclass(frozen=True, slots=True, kw_only=True)
class ForeignObject:
    """An object of a foreign document, and the notes on what in it is not understood.

    Attributes:
        fields: Its values by name.
        path: Where it stands, for the notes; ends in a dot unless it is the whole document.
        notes: Shared by all parts of the document, in the order in which they are read.
    """

    fields: Mapping[str, object]
    path: str = ""
    notes: list[str] = field(default_factory=list)

    def read(self, name: str, kind: type[_Value]) -> _Value | None:
        """Return a value of that very type."""
        value = self.fields.get(name)
        if type(value) is kind:
            return value
        if value is not None:
            shown = f" ({value!s:.20})" if isinstance(value, int | float) else ""
            wanted = kind_of(kind())
            self.notes.append(f"{self.path}{name} is {kind_of(value)}{shown}, not {wanted}")
        return None

    def count(self, name: str, *, most: int) -> int | None:
        """Return a whole number from 0 to `most`; some write 12 as 12.0 or as "12"."""
        value = self.fields.get(name)
        if isinstance(value, str | float) and str(value).removesuffix(".0").isdecimal():
            value = int(float(value))
        if type(value) is int and 0 <= value <= most:
            return value
        if value is not None:
            self.notes.append(f"{self.path}{name} is no count up to {most}: {value!s:.20}")
        return None
