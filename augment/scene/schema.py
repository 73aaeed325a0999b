"""Schema of the project's own JSON documents, and reasons for violations.

A value is a dataclass whose fields say in these types what may stand in them; a `TypeAdapter`
reads and writes it. Values are strict: no text for numbers, no unknown fields, nothing that is
not finite. Names carry their units.
"""

import marshal
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Annotated, Any, Generic, Self, TypeVar

from pydantic import ConfigDict, Field, GetCoreSchemaHandler, Strict, TypeAdapter, ValidationError
from pydantic_core import CoreSchema, core_schema

from augment.errors import InvalidDocument
from augment.geometry.polyline import Polyline

VERSION = 1


class LabelEnum(StrEnum):
    """Names as documents have them, each with the words that people read for it."""

    _value_: str
    label: str

    def __new__(cls, value: str, label: str = "") -> Self:
        member = str.__new__(cls, value)
        member._value_, member.label = value, label
        return member


CLOSED = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Of a whole document; the values in it go by the same."""

_TURN_RAD = math.ceil(2.0 * math.pi * 1e4) / 1e4
# The first fault of a list is told, and lists have an end: a broken file of some megabytes is
# refused as fast as it is read.
MOST_POINTS = 100_000
LONGEST_KEPT = 4_000_000
"""Bytes of a document whose value is kept."""

Real = Annotated[float, Strict()]
Whole = Annotated[int, Strict()]
Yes = Annotated[bool, Strict()]
Text = Annotated[str, Strict()]
Id = Annotated[Text, Field(min_length=1, max_length=40, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.:-]*$")]
Metres = Annotated[Real, Field(ge=-100_000.0, le=100_000.0)]
WorldMetres = Annotated[Real, Field(ge=-1e8, le=1e8)]
Heading = Annotated[Real, Field(ge=-_TURN_RAD, le=_TURN_RAD)]
Size = Annotated[Real, Field(gt=0.0, le=100.0)]
Speed = Annotated[Real, Field(ge=0.0, le=100.0)]
Limit = Annotated[Real, Field(gt=0.0, le=100.0)]
MOST_OBJECTS = 100
Count = Annotated[Whole, Field(ge=1, le=MOST_OBJECTS)]
PointPair = tuple[Metres, Metres]
Ring = Annotated[
    tuple[PointPair, ...], Field(fail_fast=True, min_length=3, max_length=MOST_POINTS)
]


@dataclass(frozen=True)
class Listed:
    """A value that stands as a list in a document.

    Attributes:
        items: Type of the list.
        make, to_list: From the list to the value and back.
    """

    items: Any
    make: Callable[[Any], Any]
    to_list: Callable[[Any], Any]

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(
            self.make,
            handler.generate_schema(self.items),
            serialization=core_schema.plain_serializer_function_ser_schema(self.to_list),
        )


_SOME = Field(fail_fast=True, min_length=2, max_length=MOST_POINTS)
Line = Annotated[
    Polyline,
    Listed(Annotated[list[PointPair], _SOME], Polyline, lambda line: line.points_m.tolist()),
]


Value = TypeVar("Value")
Problem = tuple[str, str]
"""The path of a fault inside its document, and a sentence."""


@dataclass(frozen=True, slots=True)
class Codec(Generic[Value]):
    """A value as a JSON document and back, exactly; fields without a value are left out.

    Attributes:
        what: The kind of document, for sentences and for its "format".
        shape: Of the value.
        problems: Finds faults that reach over more than one field.
    """

    what: str
    shape: TypeAdapter[Value]
    problems: Callable[[Value], Iterable[Problem]] = lambda value: ()

    @property
    def frame(self) -> dict[str, Any]:
        """First fields of every document of the kind."""
        return {"format": f"scenario-arena/{self.what}", "version": VERSION}

    def to_document(self, value: Value) -> dict[str, Any]:
        """Return the document that describes a value.

        Raises:
            InvalidDocument: The value breaks a rule of the format, so nobody could read it again.
        """
        document: dict[str, Any] = self.frame | self.dump(value)
        self.from_document(document)
        return document

    def dump(self, value: Value) -> Any:
        """Return the document without its frame, and without reading it again."""
        return self.shape.dump_python(value, mode="json", by_alias=True, exclude_none=True)

    def from_document(self, document: object) -> Value:
        """Return the value that a document describes: what `json.loads` gives, or a dict like it.

        Raises:
            InvalidDocument: With one problem a fault, each with its path inside the document.
        """
        if not isinstance(document, dict):
            text = f"expected an object, got {type(document).__name__}"
            raise InvalidDocument(self.what, [("", text)])
        wanted, format_name = self.frame["format"], document.get("format")
        if format_name != wanted:
            text = f"expected {wanted!r}, got {_shorten(format_name)}"
            raise InvalidDocument(self.what, [("format", text)])
        version = document.get("version")
        if type(version) is not int or version != VERSION:
            text = (
                f"version {_shorten(version)} is not known; this program reads version {VERSION}"
            )
            raise InvalidDocument(self.what, [("version", text)])
        parts = {name: part for name, part in document.items() if name not in self.frame}
        return self.from_parts(parts)

    def from_parts(self, parts: object) -> Value:
        """Return the value of a document without its frame; as `from_document`."""
        try:
            value = self.shape.validate_python(parts)
        except ValidationError as fault:
            raise InvalidDocument(self.what, list_problems(fault)) from None
        problems = list(self.problems(value))
        if problems:
            raise InvalidDocument(self.what, problems)
        return value


def remember(read: Callable[[object], Value], most: int) -> Callable[[object], Value]:
    """Return a reader that keeps the last values, by the content of their documents.

    Args:
        read: From a document to a value that nobody changes.
        most: So many values are kept.
    """

    @lru_cache(maxsize=most)
    def read_content(content: bytes) -> Value:
        return read(marshal.loads(content))

    def read_once(document: Any) -> Value:
        try:
            # Version 2 has no references: what is equal has equal bytes.
            content = marshal.dumps(document, 2)
        except ValueError:  # it holds what no JSON does
            return read(document)
        return read_content(content) if len(content) <= LONGEST_KEPT else read(document)

    return read_once


def list_problems(fault: ValidationError) -> list[tuple[str, str]]:
    """Each fault that pydantic found, as its path and a sentence."""
    return [(path(*error["loc"]), _sentence(error)) for error in fault.errors(include_url=False)]


def path(*steps: int | str) -> str:
    """A place inside a document: `lanes[3].centerline_m[0][1]`."""
    shown = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)
    return shown.removeprefix(".")


# Private


def _sentence(error: Any) -> str:
    if error["type"] == "missing":
        return "is missing"
    if error["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        return "is not a field of this format"
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    reason = "Input should be an object" if error["type"] == "dataclass_type" else error["msg"]
    # What is a tuple here is a list in JSON.
    reason = reason.replace("tuple", "list").replace("Tuple", "List")
    return f"{reason}, got {_shorten(error['input'])}"


def _shorten(value: object) -> str:
    if isinstance(value, dict | list):
        return f"a {'list' if isinstance(value, list) else 'object'} of {len(value)}"
    text = repr(value) if not isinstance(value, int) or abs(value) < 1e30 else "a huge number"
    return text if len(text) <= 60 else text[:57] + "..."
