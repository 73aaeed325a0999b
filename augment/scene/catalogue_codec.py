"""A scenario of the catalogue as a JSON document and back.

The document carries the modification document of the reference, so one file is one scenario.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, Strict

from augment.errors import InvalidDocument
from augment.scene.catalogue import ScenarioType
from augment.scene.claims import Claim, ClaimKind
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import AgentType
from augment.scene.modification import Modification
from augment.scene.schema import VERSION, Document, read

SCENARIO_FORMAT = "scenario-arena/scenario"

Text = Annotated[str, Field(min_length=1, pattern=r"\S")]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueEntry:
    """A scenario as the catalogue gives it.

    Attributes:
        scene: The name of its base scene.
        instruction: What is to be changed, in the user's words.
        keep_traffic: Whether the recorded traffic stays in the scene.
        notes: What a reader of the catalogue should know; may be empty.
        claims: What the instruction says about the reference; may be empty.
    """

    slug: str
    scene: str
    type: ScenarioType
    instruction: str
    keep_traffic: bool
    provenance: str
    notes: str
    reference: Modification
    claims: tuple[Claim, ...] = ()


class ClaimDocument(Document):
    """A `Claim`."""

    kind: Annotated[ClaimKind, Strict(False)]
    value: float
    agents: Annotated[list[Text], Field(fail_fast=True)] = []
    type: Annotated[AgentType, Strict(False)] | None = None


class EntryDocument(Document):
    """A `CatalogueEntry`."""

    format: str
    version: int
    slug: Text
    scene: Text
    type: Annotated[ScenarioType, Strict(False)]
    instruction: Text
    keep_traffic: bool
    provenance: Text
    notes: str = ""
    claims: Annotated[list[ClaimDocument], Field(fail_fast=True)] = []
    reference: dict[str, Any]


def entry_to_document(entry: CatalogueEntry) -> dict[str, Any]:
    """The entry as a JSON document, the reference last because it is long."""
    return {
        "format": SCENARIO_FORMAT,
        "version": VERSION,
        "slug": entry.slug,
        "scene": entry.scene,
        "type": entry.type.value,
        "instruction": entry.instruction,
        "keep_traffic": entry.keep_traffic,
        "provenance": entry.provenance,
        "notes": entry.notes,
        "claims": [_claim_to_document(claim) for claim in entry.claims],
        "reference": modification_to_document(entry.reference),
    }


def entry_from_document(document: object) -> CatalogueEntry:
    """The entry that a JSON document describes; whether it fits its scene is not asked here.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    what = "scenario"
    given = read(document, EntryDocument, what=what, format_name=SCENARIO_FORMAT)
    try:
        reference = modification_from_document(given.reference)
    except InvalidDocument as fault:
        problems = [(f"reference.{path}", text) for path, text in fault.problems]
        raise InvalidDocument(what, problems) from None
    return CatalogueEntry(
        slug=given.slug,
        scene=given.scene,
        type=given.type,
        instruction=given.instruction,
        keep_traffic=given.keep_traffic,
        provenance=given.provenance,
        notes=given.notes,
        reference=reference,
        claims=tuple(
            Claim(kind=one.kind, value=one.value, agents=tuple(one.agents), type=one.type)
            for one in given.claims
        ),
    )


def _claim_to_document(claim: Claim) -> dict[str, Any]:
    document: dict[str, Any] = {"kind": claim.kind.value}
    if claim.agents:
        document["agents"] = list(claim.agents)
    if claim.type is not None:
        document["type"] = claim.type.value
    return {**document, "value": claim.value}
