"""A scenario of the catalogue as a JSON document and back.

The document carries the modification document of the reference, so one file is one scenario.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from pydantic import Field, TypeAdapter

from augment.errors import InvalidDocument
from augment.scene.codec import (
    intent_from_document,
    intent_to_document,
    modification_from_document,
    modification_to_document,
)
from augment.scene.entities import Modification, ScenarioType
from augment.scene.intent import Intent
from augment.scene.schema import CLOSED, Text, Yes, read, write

SCENARIO_FORMAT = "scenario-arena/scenario"

ENGLISH = "en"

Parsed = TypeVar("Parsed")
_Words = Annotated[Text, Field(min_length=1, pattern=r"\S")]
_Language = Annotated[Text, Field(pattern=r"^[a-z]{2}$")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Wording:
    """A wish in one language (ISO 639-1)."""

    language: _Language
    text: _Words


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueEntry:
    """A scenario as the catalogue gives it.

    Attributes:
        scene: The name of its base scene.
        language: Of the instruction.
        instruction: What is to be changed, in the user's words.
        paraphrases: The same wish in other words, each to be answered by the same reference.
        keep_traffic: Whether the recorded traffic stays in the scene.
        notes: What a reader of the catalogue should know; may be empty.
        intent: What the instruction asks for; None where nobody has written it down.
    """

    __pydantic_config__ = CLOSED

    slug: _Words
    scene: _Words
    type: ScenarioType
    language: Annotated[_Language, Field(exclude_if=lambda code: code == ENGLISH)] = ENGLISH
    instruction: _Words
    paraphrases: Annotated[
        tuple[Wording, ...], Field(max_length=20, exclude_if=lambda wordings: not wordings)
    ] = ()
    keep_traffic: Yes
    provenance: _Words
    notes: Text = ""
    intent: Annotated[Intent | None, Field(exclude=True)] = None
    reference: Annotated[Modification, Field(exclude=True)]


_ENTRY = TypeAdapter(CatalogueEntry)


def entry_to_document(entry: CatalogueEntry) -> dict[str, Any]:
    """The entry as a JSON document, the reference last because it is long.

    English and an instruction without paraphrases go without saying.
    """
    return {
        **write(entry, _ENTRY, format_name=SCENARIO_FORMAT),
        "intent": None if entry.intent is None else intent_to_document(entry.intent),
        "reference": modification_to_document(entry.reference),
    }


def entry_from_document(document: object) -> CatalogueEntry:
    """The entry that a JSON document describes; whether it fits its scene is not asked here.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    if isinstance(document, dict):
        document = dict(document)
        for name, parse in (
            ("reference", modification_from_document),
            ("intent", intent_from_document),
        ):
            if document.get(name) is not None:
                document[name] = _part(name, parse, document[name])
    return read(document, _ENTRY, what="scenario", format_name=SCENARIO_FORMAT)


def _part(name: str, parse: Callable[[object], Parsed], document: object) -> Parsed:
    """A document within the entry's, its faults with their path in the whole."""
    try:
        return parse(document)
    except InvalidDocument as fault:
        problems = [(f"{name}.{path}", text) for path, text in fault.problems]
        raise InvalidDocument("scenario", problems) from None
