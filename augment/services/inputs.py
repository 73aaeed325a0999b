"""Requests as dataclasses: each field says once what it holds and how it is asked for.

`input_field` declares a field, `to_inputs` lists those of a request. Forms, bodies of the API and
the options of commands are made of that list: a field that is added is added to all of them.
"""

from argparse import ArgumentTypeError, BooleanOptionalAction
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from decimal import Decimal, InvalidOperation
from enum import StrEnum
from typing import Any, TypeVar

from augment.errors import InvalidDocument

Request = TypeVar("Request")


class InputKind(StrEnum):
    """Kind of a field: a text, a number, yes or no, one of several words, or many texts."""

    TEXT = "text"
    WHOLE = "whole"
    NUMBER = "number"
    DECIMAL = "decimal"
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
        default: What holds where nothing is given; MISSING where something must be. None is
            unknown, open or without limit.
    """

    name: str = ""
    kind: InputKind
    label: str
    help: str = ""
    unit: str = ""
    least: float | Decimal | None = None
    most: float | Decimal | None = None
    choices: Mapping[str, str] = field(default_factory=dict)
    default: Any = MISSING

    @property
    def title(self) -> str:
        """The label with the unit."""
        return f"{self.label}, {self.unit}" if self.unit else self.label

    def show(self, value: Any) -> str:
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
        """True if the request can't be made without it."""
        return self.default is MISSING


def input_field(
    kind: InputKind, label: str, help: str = "", *, default: Any = MISSING, **more: Any
) -> Any:
    """Declare a field of a request; `more` as in Input."""
    metadata = {"input": {"kind": kind, "label": label, "help": help, "default": default, **more}}
    return field(default=default, metadata=metadata)


def to_inputs(request: type) -> tuple[Input, ...]:
    """Return the inputs of a request, in the order of its fields."""
    return tuple(
        Input(name=declared.name, **declared.metadata["input"])
        for declared in fields(request)
        if "input" in declared.metadata
    )


def read_request(request: type[Request], values: Mapping[str, Any], **more: Any) -> Request:
    """Return the request that the values of a form, a body or a command line make.

    Args:
        request: A dataclass with inputs.
        values: Values by name; empty ones leave the default, other names are ignored.
        more: What else the request holds.
    """
    return request(**read_values(to_inputs(request), values) | more)


def read_values(inputs: Iterable[Input], entered: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of these inputs that are not empty."""
    values = {declared.name: entered.get(declared.name) for declared in inputs}
    return {name: value for name, value in values.items() if value not in (None, "")}


def check_bounds(request: Any) -> None:
    """Do nothing for a request whose numbers are within their bounds.

    Raises:
        InvalidDocument: Some are not.
    """
    problems = [
        (declared.name, f"goes from {declared.least:g} to {declared.most:g}, not {value:g}")
        for declared in to_inputs(type(request))
        if declared.least is not None and declared.most is not None
        if (value := getattr(request, declared.name)) is not None
        if value != value or not declared.least <= value <= declared.most  # NaN is not itself
    ]
    if problems:
        raise InvalidDocument("request", problems)


def read_decimal(text: str) -> Decimal:
    """Return the finite decimal that somebody typed, such as 2.50.

    Raises:
        ArgumentTypeError: It is none.
    """
    try:
        value = Decimal(text)
    except InvalidOperation:
        value = Decimal("NaN")
    if not value.is_finite():
        raise ArgumentTypeError(f"{text!r} is no number such as 2.50")
    return value


def add_options(parser: Any, inputs: Iterable[Input], *, is_any_required: bool = True) -> None:
    """Give a command an option for each; the first text that is required, or a slug, has no name.

    Args:
        parser: Of the command, or a group of it.
        inputs: What is asked for; `is_fresh` becomes --fresh.
        is_any_required: Whether what the request needs has to be given; else all may be left out
            and is None then.
    """
    has_positional = False
    for declared in inputs:
        is_required = declared.is_required and is_any_required
        is_named = declared.name == "slug" and is_any_required
        is_positional = (
            declared.kind is InputKind.TEXT and (is_required or is_named) and not has_positional
        )
        has_positional |= is_positional
        default = None if declared.is_required or not is_any_required else declared.default
        words = declared.explanation
        if default and not isinstance(default, bool):
            words += f" (default: {default})"
        arguments: dict[str, Any] = {"help": words.replace("%", "%%")}
        if is_positional and not is_required:
            arguments |= {"nargs": "?", "default": default}
        elif not is_positional:
            arguments |= {"dest": declared.name, "required": is_required, "default": default}
        match declared.kind:
            case InputKind.SWITCH:
                arguments["action"] = BooleanOptionalAction
            case InputKind.CHOICE:
                arguments["choices"] = list(declared.choices)
            case InputKind.LINES | InputKind.NAMES:
                # An option that is given twice loses nothing; argparse extends only lists.
                default = None if default is None else list(default)
                arguments |= {"nargs": "+", "action": "extend", "default": default}
            case InputKind.WHOLE | InputKind.NUMBER | InputKind.DECIMAL:
                arguments["type"] = _NUMBERS[declared.kind]
                arguments["metavar"] = "PERCENT" if declared.unit == "%" else "N"
        flag = declared.name.removeprefix("is_").replace("_", "-")
        parser.add_argument(declared.name if is_positional else f"--{flag}", **arguments)


_NUMBERS = {InputKind.WHOLE: int, InputKind.NUMBER: float, InputKind.DECIMAL: read_decimal}
