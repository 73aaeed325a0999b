"""Requests as dataclasses: each field says once what it holds and how it is asked for.

`input_field` declares a field, `inputs_of` lists those of a request. Forms, bodies of the API and
the options of commands are made of that list: a field that is added is added to all of them.
"""

from argparse import BooleanOptionalAction
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from enum import StrEnum
from typing import Any

from django.core.management.base import CommandParser

from augment.errors import InvalidDocument


class InputKind(StrEnum):
    """What a field holds: a text, a number, yes or no, one of several words, or many texts."""

    TEXT = "text"
    WHOLE = "whole"
    NUMBER = "number"
    SWITCH = "switch"
    CHOICE = "choice"
    LINES = "lines"
    NAMES = "names"


@dataclass(frozen=True, slots=True, kw_only=True)
class Input:
    """A field of a request.

    Attributes:
        unit: Of a number; "%" for percent.
        least, most: The bounds of a number; `most` also of a text's length.
        choices: Words and their labels.
        default: What holds where nothing is given; MISSING where something must be.
    """

    name: str = ""
    kind: InputKind
    label: str
    help: str = ""
    unit: str = ""
    least: float | None = None
    most: float | None = None
    choices: Mapping[str, str] = field(default_factory=dict)
    default: Any = MISSING

    @property
    def title(self) -> str:
        """The label with the unit."""
        return f"{self.label}, {self.unit}" if self.unit else self.label

    def shown(self, value: Any) -> str:
        """Return a value as a page shows it."""
        if self.kind is InputKind.SWITCH:
            return "yes" if value else "no"
        if self.kind is InputKind.CHOICE:
            return self.choices[value]
        return f"{value:,g} {self.unit}".strip() if self.kind is InputKind.NUMBER else str(value)

    @property
    def explanation(self) -> str:
        """The title and, where there is any, the help."""
        return f"{self.title}. {self.help}" if self.help else self.title

    @property
    def is_required(self) -> bool:
        """Whether the request can't be made without it."""
        return self.default is MISSING


def input_field(
    kind: InputKind, label: str, help: str = "", *, default: Any = MISSING, **more: Any
) -> Any:
    """Declare a field of a request; `more` as in Input."""
    metadata = {"input": {"kind": kind, "label": label, "help": help, "default": default, **more}}
    return field(default=default, metadata=metadata)


def inputs_of(request: type) -> tuple[Input, ...]:
    """Return what a request asks for, in the order of its fields."""
    return tuple(
        Input(name=one.name, **one.metadata["input"])
        for one in fields(request)
        if "input" in one.metadata
    )


def check_bounds(request: Any) -> None:
    """Do nothing for a request whose numbers are within their bounds.

    Raises:
        InvalidDocument: Some are not.
    """
    problems = [
        (one.name, f"goes from {one.least:g} to {one.most:g}, not {value:g}")
        for one in inputs_of(type(request))
        if one.least is not None and one.most is not None
        if (value := getattr(request, one.name)) is not None
        if not one.least <= value <= one.most
    ]
    if problems:
        raise InvalidDocument("request", problems)


def add_options(parser: CommandParser, inputs: Iterable[Input]) -> None:
    """Give a command an option for each; a text that is required stands without a name."""
    for one in inputs:
        is_positional = one.kind is InputKind.TEXT and one.is_required
        words = one.explanation
        if one.default and not isinstance(one.default, bool) and not one.is_required:
            words += f" (default: {one.default})"
        given: dict[str, Any] = {"help": words.replace("%", "%%")}
        if not is_positional:
            default = None if one.is_required else one.default
            given |= {"required": one.is_required, "default": default}
        match one.kind:
            case InputKind.SWITCH:
                given["action"] = BooleanOptionalAction
            case InputKind.CHOICE:
                given["choices"] = list(one.choices)
            case InputKind.LINES | InputKind.NAMES:
                # An option that is given twice loses nothing; argparse extends only lists.
                default = None if one.is_required else list(one.default)
                given |= {"nargs": "+", "action": "extend", "default": default}
            case InputKind.WHOLE | InputKind.NUMBER:
                given["type"] = int if one.kind is InputKind.WHOLE else float
                given["metavar"] = "PERCENT" if one.unit == "%" else "N"
        parser.add_argument(
            one.name if is_positional else f"--{one.name.replace('_', '-')}", **given
        )
