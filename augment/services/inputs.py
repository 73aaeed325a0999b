"""Requests as dataclasses: each field says once what it holds and how it is asked for.

`input_field` declares a field, `inputs_of` lists those of a request. Forms, bodies of the API and
the options of commands are made of that list: a field that is added is added to all of them.
"""

from __future__ import annotations

from argparse import BooleanOptionalAction
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from enum import StrEnum
from typing import Any

from django.core.management.base import CommandParser


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
        default: What holds where nothing is given; None where something must be.
    """

    name: str = ""
    kind: InputKind
    label: str
    help: str = ""
    unit: str = ""
    least: float | None = None
    most: float | None = None
    choices: Mapping[str, str] = field(default_factory=dict)
    default: Any = None

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
    def is_required(self) -> bool:
        """Whether the request can't be made without it."""
        return self.default is None


def input_field(
    kind: InputKind, label: str, help: str = "", *, default: Any = None, **more: Any
) -> Any:
    """Declare a field of a request; `more` as in Input."""
    metadata = {"input": {"kind": kind, "label": label, "help": help, "default": default, **more}}
    return field(default=MISSING if default is None else default, metadata=metadata)


def inputs_of(request: type) -> tuple[Input, ...]:
    """Return what a request asks for, in the order of its fields."""
    return tuple(
        Input(name=one.name, **one.metadata["input"])
        for one in fields(request)
        if "input" in one.metadata
    )


def add_options(parser: CommandParser, inputs: Iterable[Input]) -> None:
    """Give a command an option for each; a text that is required stands without a name."""
    for one in inputs:
        is_positional = one.kind is InputKind.TEXT and one.is_required
        words = one.help or one.title
        given: dict[str, Any] = {"help": words.replace("%", "%%")}
        if not is_positional:
            given |= {"required": one.is_required, "default": one.default}
        match one.kind:
            case InputKind.SWITCH:
                given["action"] = BooleanOptionalAction
            case InputKind.CHOICE:
                given["choices"] = list(one.choices)
            case InputKind.LINES | InputKind.NAMES:
                given["nargs"] = "+"
            case InputKind.WHOLE | InputKind.NUMBER:
                given["type"] = int if one.kind is InputKind.WHOLE else float
                given["metavar"] = "PERCENT" if one.unit == "%" else "N"
        parser.add_argument(
            one.name if is_positional else f"--{one.name.replace('_', '-')}", **given
        )
