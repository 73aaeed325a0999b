"""Rules for a row from outside beyond its columns: those of the forms and the API.

Each rule is the function by which the form or the API reads the same thing.
"""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from django.db.models import Model

from augment import models
from augment.benchmark.report import CARD, report_from_document
from augment.errors import InvalidDocument
from augment.scene import codec
from augment.services import texts
from augment.services.endpoints.known_endpoints import EndpointFacts, check_facts
from augment.services.scenarios import choosing, scene_imports, scenes
from augment.simulation.planners import OFFSETS_M
from augment.variants.options import MOST_SAMPLES, options_from_document
from augment.variants.respondents import ModelRole

LONGEST_TRACE = 1 << 26
"""Of a drive to look at, unpacked: some hundred times what 15 s take."""


def _check_document(read: Callable[[Any], object], document: Any) -> None:
    if document is not None:
        read(document)


def _check_scene(row: models.BaseScene) -> None:
    texts.check_slug(row.slug, what="scene")
    codec.scene_from_document(row.document)
    scene_imports.note_sentences(row.notes)
    _check_document(codec.recording_from_document, row.recording)


def _check_scenario(row: models.Scenario) -> None:
    texts.check_slug(row.slug, what="scenario")
    choosing.label_for(row.type)
    texts.check_prose(
        "instruction", row.instruction, what="scenario", longest=scenes.INSTRUCTION_LENGTH
    )
    texts.check_picture_name("original_image", row.original_image)
    _check_document(codec.intent_from_document, row.intent)
    if row.reference is not None:
        scene = scenes.LoadedScenario(row).scene
        scenes.check_reference(scene, codec.modification_from_document(row.reference))


def _check_benchmark(row: models.Benchmark) -> None:
    texts.check_slug(row.slug, what="benchmark")
    texts.one_line("title", row.title, what="benchmark")


def _check_endpoint(row: models.Endpoint) -> None:
    texts.check_slug(row.label, what="endpoint")
    names = [field.name for field in fields(EndpointFacts)]
    facts = EndpointFacts(**{name: getattr(row, name) for name in names})
    check_facts(facts, is_stored=True)  # a call asks what its key is bound to


def _check_contestant(row: models.Contestant) -> None:
    texts.check_slug(row.slug, what="contestant")
    texts.one_line("name", row.name, what="contestant")
    _check_document(CARD.from_parts, row.card)
    options_from_document(row.options)
    for role, chosen in row.roles.items():
        ModelRole(role)
        texts.one_line(f"roles.{role}", chosen["model"], what="contestant")


def _check_job(row: models.GenerationJob) -> None:
    texts.one_line("name", row.name, what="job")
    if not 1 <= row.samples <= MOST_SAMPLES:
        raise InvalidDocument("job", [("samples", f"goes from 1 to {MOST_SAMPLES}")])


def _check_augmentation(row: models.Augmentation) -> None:
    texts.check_picture_name("image", row.image)
    _check_document(codec.modification_from_document, row.modification)


def _check_submission(row: models.Submission) -> None:
    texts.check_stored_name("stored", row.stored)
    _check_document(report_from_document, row.report)


def _check_drive(row: models.Simulation) -> None:
    if row.offsets not in OFFSETS_M:
        raise InvalidDocument("drive", [("offsets", f"one of {', '.join(OFFSETS_M)}")])
    if row.trace is not None:
        unpacking = zlib.decompressobj()
        try:
            unpacking.decompress(row.trace, LONGEST_TRACE)
        except zlib.error as error:
            raise InvalidDocument("drive", [("trace", str(error))]) from None
        if not unpacking.eof:
            raise InvalidDocument("drive", [("trace", f"more than {LONGEST_TRACE} bytes")])


RULES: Mapping[type[Model], Callable[[Any], None]] = {
    models.Augmentation: _check_augmentation,
    models.BaseScene: _check_scene,
    models.Benchmark: _check_benchmark,
    models.Contestant: _check_contestant,
    models.Endpoint: _check_endpoint,
    models.EndpointModel: models.EndpointModel.clean,
    models.GenerationJob: _check_job,
    models.IntentReading: lambda row: _check_document(codec.intent_from_document, row.document),
    models.Scenario: _check_scenario,
    models.SceneUpload: lambda row: texts.check_stored_name("stored", row.stored),
    models.Simulation: _check_drive,
    models.Submission: _check_submission,
    models.SweepValue: lambda row: _check_document(
        codec.modification_from_document, row.modification
    ),
    models.UploadMoment: lambda row: texts.check_stored_name("picture", row.picture),
}
"""What is raised is an AugmentError, or a ValueError, KeyError or TypeError of a document."""
