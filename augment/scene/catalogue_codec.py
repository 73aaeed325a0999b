"""A scenario of the catalogue as a JSON document and back.

The document carries the modification document of the reference, so one file is one scenario.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from pydantic import Field, Strict

from augment.errors import InvalidDocument
from augment.scene.catalogue import ScenarioType
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.intent import Intent
from augment.scene.intent_codec import intent_from_document, intent_to_document
from augment.scene.modification import Modification
from augment.scene.schema import VERSION, Document, read

SCENARIO_FORMAT = "scenario-arena/scenario"

Parsed = TypeVar("Parsed")
Text = Annotated[str, Field(min_length=1, pattern=r"\S")]
_Language = Annotated[str, Field(pattern=r"^[a-z]{2}$")]


ENGLISH = "en"


@dataclass(frozen=True, slots=True, kw_only=True)
class Wording:
    """A wish in one language (ISO 639-1)."""

    language: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueEntry:
    """A scenario as the catalogue gives it.

    Attributes:
        scene: The name of its base scene.
        instruction: What is to be changed, in the user's words.
        language: Of the instruction.
        paraphrases: The same wish in other words, each to be answered by the same reference.
        keep_traffic: Whether the recorded traffic stays in the scene.
        notes: What a reader of the catalogue should know; may be empty.
        intent: What the instruction asks for; None where nobody has written it down.
    """

    slug: str
    scene: str
    type: ScenarioType
    instruction: str
    keep_traffic: bool
    provenance: str
    notes: str
    reference: Modification
    intent: Intent | None = None
    language: str = ENGLISH
    paraphrases: tuple[Wording, ...] = ()


class WordingDocument(Document):
    """A `Wording`."""

    language: _Language
    text: Text


class EntryDocument(Document):
    """A `CatalogueEntry`."""

    format: str
    version: int
    slug: Text
    scene: Text
    type: Annotated[ScenarioType, Strict(False)]
    language: _Language = ENGLISH
    instruction: Text
    paraphrases: Annotated[list[WordingDocument], Field(max_length=20)] = []
    keep_traffic: bool
    provenance: Text
    notes: str = ""
    intent: dict[str, Any] | None = None
    reference: dict[str, Any]


def entry_to_document(entry: CatalogueEntry) -> dict[str, Any]:
    """The entry as a JSON document, the reference last because it is long.

    English and an instruction without paraphrases go without saying.
    """
    language = {} if entry.language == ENGLISH else {"language": entry.language}
    others = [
        {"language": paraphrase.language, "text": paraphrase.text}
        for paraphrase in entry.paraphrases
    ]
    return {
        "format": SCENARIO_FORMAT,
        "version": VERSION,
        "slug": entry.slug,
        "scene": entry.scene,
        "type": entry.type.value,
        **language,
        "instruction": entry.instruction,
        **({"paraphrases": others} if others else {}),
        "keep_traffic": entry.keep_traffic,
        "provenance": entry.provenance,
        "notes": entry.notes,
        "intent": None if entry.intent is None else intent_to_document(entry.intent),
        "reference": modification_to_document(entry.reference),
    }


def entry_from_document(document: object) -> CatalogueEntry:
    """The entry that a JSON document describes; whether it fits its scene is not asked here.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    given = read(document, EntryDocument, what="scenario", format_name=SCENARIO_FORMAT)
    reference = _part("reference", modification_from_document, given.reference)
    intent = None
    if given.intent is not None:
        intent = _part("intent", intent_from_document, given.intent)
    return CatalogueEntry(
        slug=given.slug,
        scene=given.scene,
        type=given.type,
        instruction=given.instruction,
        keep_traffic=given.keep_traffic,
        provenance=given.provenance,
        notes=given.notes,
        reference=reference,
        intent=intent,
        language=given.language,
        paraphrases=tuple(
            Wording(language=paraphrase.language, text=paraphrase.text)
            for paraphrase in given.paraphrases
        ),
    )


def _part(name: str, parse: Callable[[object], Parsed], document: object) -> Parsed:
    """A document within the entry's, its faults with their path in the whole."""
    try:
        return parse(document)
    except InvalidDocument as fault:
        problems = [(f"{name}.{path}", text) for path, text in fault.problems]
        raise InvalidDocument("scenario", problems) from None
