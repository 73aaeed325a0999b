"""InterPlan's scenarios on nuPlan's logs, as scenes and scenarios.

A folder holds interPlan's modification file and nuPlan's logs and maps, wherever in it. Each base
token becomes a scene, each of its special scenarios a scenario with its human reference; what is
stored already stays.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from augment.checks.derived import describe_change
from augment.errors import AugmentError, Conflict, InvalidDocument
from augment.formats.apart import UntrustedInput
from augment.formats.documents import MAX_CHARACTERS, read_yaml_file
from augment.formats.interplan import file as interplan_file
from augment.formats.nuplan_log import NuPlan
from augment.formats.nuplan_map import REACH_M
from augment.models import BaseScene, Scenario
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.density import keep_clear
from augment.scene.entities import AgentType, InterplanRules, Scene, SceneOptions, without_traffic
from augment.scene.intent import IntentOrigin
from augment.services.scenarios.scene_imports import free_scene_slug, keep_reading
from augment.services.scenarios.scenes import NewScenario, add_scenario

_VEHICLE, _BUS = AgentType.VEHICLE, AgentType.BUS
_Sizes = Sequence[tuple[float, float]]


class StepKind(StrEnum):
    """Kind of a step of an import."""

    LEFT_OUT = "left out"  # something of the file is not kept
    LOG = "log"  # a log was looked through
    NEW = "new"  # a scenario was added
    OLD = "old"  # a scenario was there already
    SKIPPED = "skipped"  # a special scenario is none here


@dataclass(frozen=True, slots=True)
class ImportStep:
    """Looked-at, kept or skipped scenario, and the sentence that says so."""

    kind: StepKind
    text: str


def import_interplan(*, folder: Path, data: Path | None = None) -> Iterator[ImportStep]:
    """Keep every special scenario whose base token lies in a log, one by one.

    Args:
        folder: Holds interPlan's YAML somewhere.
        data: Holds nuPlan's logs and maps somewhere; None for the same folder.

    Yields:
        Each step as it happens.

    Raises:
        InvalidDocument: There is not exactly one modification file, or it breaks its format.
    """
    file, problems = interplan_file.parse_file(
        read_yaml_file(_modification_file_in(folder), what=interplan_file.WHAT)
    )
    for place, problem in problems:
        yield ImportStep(StepKind.SKIPPED, f"Skipped for a fault: {place}: {problem}")
    by_token = file.modification_details_dictionary
    wanted = {token: entry_of for token, entry_of in by_token.items() if entry_of.special_scenario}
    for token in (token for token in by_token if token not in wanted):
        text = f"Left out: base token {token}, without a special scenario."
        yield ImportStep(StepKind.LEFT_OUT, text)
    logs: dict[str, tuple[Path, _Sizes]] = {}
    paths = sorted((data or folder).rglob("*.db"))
    for number, path in enumerate(paths, start=1):
        try:
            by_token_m = UntrustedInput(path=path, format=NuPlan.name).vehicles(list(wanted))
            outcome = f"{len(by_token_m)} base tokens"
            logs = {token: (path, sizes_m) for token, sizes_m in by_token_m.items()} | logs
        except InvalidDocument as fault:
            outcome = str(fault)
        yield ImportStep(StepKind.LOG, f"Log {number} of {len(paths)}, {path.name}: {outcome}")
    for token, details in wanted.items():
        if token in logs:
            yield from _keep_token(token, file, *logs[token])
        else:
            yield from _skip_all(token, details, "none of the logs has a frame of its base token")


def _modification_file_in(folder: Path) -> Path:
    """Return the one modification file in a folder, whatever it is called."""
    files = [
        file
        for file in ([folder] if folder.is_file() else sorted(folder.rglob("*.y*ml")))
        if file.is_file()
        and file.stat().st_size <= MAX_CHARACTERS
        and interplan_file.TOKENS.encode() in file.read_bytes()
    ]
    if len(files) != 1:
        problem = (
            f"{len(files)} YAML files with {interplan_file.TOKENS} are there; there must be one"
        )
        raise InvalidDocument(interplan_file.WHAT, [(str(folder), problem)])
    return files[0]


def _skip_all(token: str, details: interplan_file.Details, reason: str) -> Iterator[ImportStep]:
    for index in details.special_scenario or {}:
        yield ImportStep(StepKind.SKIPPED, f"{token}-s{index}: skipped. {reason}")


def _keep_token(
    token: str, file: interplan_file.File, log: Path, vehicles_m: _Sizes
) -> Iterator[ImportStep]:
    details = file.modification_details_dictionary[token]
    try:
        recorded = UntrustedInput(path=log, format=NuPlan.name, reach_m=REACH_M)
        source, reading = recorded.read(item=token, frame=None, name=f"interplan-{token}")
        try:
            row, _ = keep_reading(reading, source=source, path=log)
        except Conflict:  # an earlier release kept less of the map under this name
            scene = replace(reading.scene, name=free_scene_slug(reading.scene.name))
            reading = replace(reading, scene=scene)
            row, _ = keep_reading(reading, source=source, path=log)
    except AugmentError as fault:
        yield from _skip_all(token, details, str(fault))
        return
    rules = SceneOptions(interplan=InterplanRules())
    scene = replace(without_traffic(reading.scene), options=rules)
    for index, entry in (details.special_scenario or {}).items():
        try:
            verbatim = _verbatim(file, token, index, entry)
            yield _keep_entry(row, scene, entry, verbatim, vehicles_m)
        except AugmentError as fault:
            yield ImportStep(StepKind.SKIPPED, f"{token}-s{index}: skipped. {fault}")


def _verbatim(
    file: interplan_file.File, token: str, index: str, entry: interplan_file.SpecialScenario
) -> dict[str, Any]:
    """Return all that an export has to say again."""
    parts: dict[str, tuple[BaseModel, set[str]]] = {
        "entry": (entry, set()),
        "details": (file.modification_details_dictionary[token], {"special_scenario"}),
        "file": (file, {interplan_file.TOKENS}),
    }
    document = {"index": index} | {
        name: part.model_dump(mode="json", exclude_unset=True, exclude=left_out)
        for name, (part, left_out) in parts.items()
    }
    try:
        json.dumps(document, allow_nan=False)
    except ValueError:
        problem = (interplan_file.entry_place(token, index), "holds a number that is not finite")
        raise InvalidDocument(interplan_file.WHAT, [problem]) from None
    return document


def _keep_entry(
    row: BaseScene,
    scene: Scene,
    entry: interplan_file.SpecialScenario,
    verbatim: dict[str, Any],
    vehicles_m: _Sizes,
) -> ImportStep:
    token, index = row.source_item, verbatim["index"]
    slug, name = f"{row.slug}-s{index}", f"{token}-s{index}"
    details = interplan_file.Details.model_validate(verbatim["details"])
    spawned, built = interplan_file.surround(
        entry, details, scene, token=token, vehicles_m=vehicles_m
    )
    verbatim["built"] = built.model_dump(mode="json", exclude_none=True)
    scene = interplan_file.follow_rules(scene, verbatim)
    reference, losses = interplan_file.read_entry(token, index, entry, scene)
    if built.boxes_m is None:
        losses.append("the boxes of vehicles, since a recorded one has no size")
    left_out = f"; left out: {', '.join(losses)}" if losses else ""
    if Scenario.objects.filter(slug=slug, base_scene=row, type=entry.type.value).exists():
        return ImportStep(StepKind.OLD, f"{name}: {slug} was there already{left_out}")
    density, goal = interplan_file.parse_suffix(entry.config)
    # Walkers and cones are put there by interPlan whoever may meet them.
    stopped = [agent for agent in reference.added if agent.type in (_VEHICLE, _BUS)]
    traffic = keep_clear(spawned.agents, stopped)
    goal_m = interplan_file.goal_place(verbatim, goal or "", scene)
    options = replace(scene.options, density=density, goal=goal, goal_m=goal_m)
    driven = replace(scene, agents=traffic, options=options)
    instruction, intent = describe_change(entry.type, reference, driven)
    new = NewScenario(
        scene=row.slug,
        type=entry.type.value,
        instruction=instruction,
        slug=slug,
        reference=modification_to_document(reference),
        intent=None if intent is None else intent_to_document(intent),
        intent_origin=IntentOrigin.DERIVED,
        density=density,
        goal=goal or "",
        traffic=traffic,
        interplan=verbatim,
    )
    add_scenario(new)
    return ImportStep(StepKind.NEW, f"{name}: {slug}{left_out}")
