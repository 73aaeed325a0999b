"""JSON that a model wrote, as typed values: nothing is converted, nothing unknown let through."""

from __future__ import annotations

from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from augment.errors import ReplyUnreadable


class Strict(BaseModel):
    """The root of what is read from answers."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


_Kind = TypeVar("_Kind", bound=Strict)


def validate(kind: type[_Kind], found: object) -> _Kind:
    """What was found, as a value of that kind.

    Raises:
        ReplyUnreadable: It is none; each sentence has a path and echoes nothing.
    """
    try:
        return kind.model_validate(found)
    except ValidationError as error:
        raise ReplyUnreadable(_sentences(error)) from None


def _sentences(error: ValidationError) -> list[str]:
    """What pydantic found, each with its path and without echoing what the model wrote."""
    sentences = []
    for fault in error.errors(include_url=False, include_input=False, include_context=False)[:8]:
        path = ".".join(ascii(part).strip("'")[:40] for part in fault["loc"]) or "the block"
        sentences.append(f"{path}: {fault['msg']}")
    return sentences
