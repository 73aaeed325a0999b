"""Drives from files to files, without a database: a part of them for each task of an array.

In: a folder as the own JSON's writer makes it: `<name>.before.json`, `<name>.modification.json`
and, where there is one, `<name>.recording.json`. Out: `<name>.drive.json`, each a function of its
own three files alone, so that all parts together are one run byte for byte.
"""

import json
import logging
import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from augment.errors import AugmentError, Conflict
from augment.formats.documents import read_json
from augment.scene import codec
from augment.services.driving.simulations import NUPLAN, Options, drive_document, load_planner
from augment.services.work import reason_sentence
from augment.simulation.drive import find_expert, run
from augment.simulation.score import ScoreKind, score_drive
from augment.simulation.trace import FORMAT
from augment.simulation.traffic import DriveSetting

_BEFORE = ".before.json"
logger = logging.getLogger(__name__)


def read_shard(text: str) -> tuple[int, int]:
    """Return which part of how many `2/8` is.

    Raises:
        Conflict: It is none.
    """
    match = re.fullmatch(r"([1-9]\d{0,5})/([1-9]\d{0,5})", text)
    part, parts = map(int, match.groups()) if match else (1, 0)
    if part > parts:
        raise Conflict(f"A shard is I/N with I from 1 to N, such as 2/8, not {text!r}.")
    return part, parts


def drive_files(
    source: Path, out: Path, *, options: Options, shard: tuple[int, int]
) -> Iterator[tuple[str, float | str]]:
    """Drive every N-th scenario of a folder; yield each name with nuPlan's score or the reason.

    A result that is there already is written anew, whole, or removed where there is none now.

    Args:
        source: Where the scenarios are.
        out: Where the results go; made where it is missing.
        options: How to drive; the planner may be any class's dotted path.
        shard: Which part, counted from 1, and how many there are.

    Raises:
        Conflict: The folder has no scenario.
        UnknownName, CannotDrive: Of the planner.
    """
    names = sorted(file.name.removesuffix(_BEFORE) for file in source.glob(f"*{_BEFORE}"))
    if not names:
        raise Conflict(f"{source} has no *{_BEFORE}: it is no folder of scenarios as own JSON.")
    load_planner(options, also=(options.planner,))
    out.mkdir(parents=True, exist_ok=True)
    part, parts = shard
    for name in names[part - 1 :: parts]:
        result = out / f"{name}.drive.json"
        try:
            document = _drive(_setting(source, name, options), options)
        except Exception as error:  # a planner from outside may raise anything
            if not isinstance(error, AugmentError):
                logger.exception("Driving %s broke.", name)
            result.unlink(missing_ok=True)
            yield name, reason_sentence(error)
            continue
        text = json.dumps({"scenario": name, **document}, indent=1, sort_keys=True) + "\n"
        scratch = out / f".{name}.{part}"
        scratch.write_text(text, encoding="utf-8")
        scratch.replace(result)
        yield name, document["score"]


# --- Private -----------------------------------------------------------------------------------


def _setting(source: Path, name: str, options: Options) -> DriveSetting:
    def read(part: str, *, what: str = "") -> object:
        return read_json(source / f"{name}.{part}.json", what=what or part)

    has_recording = (source / f"{name}.recording.json").exists()
    return DriveSetting(
        scene=codec.scene_from_document(read("before", what="scene")),
        modification=codec.modification_from_document(read("modification")),
        recording=codec.recording_from_document(read("recording")) if has_recording else None,
        reactive=options.is_reactive,
    )


def _drive(setting: DriveSetting, options: Options) -> dict[str, Any]:
    drove = run(setting, load_planner(options, also=(options.planner,)))
    expert = find_expert(setting, drove.road)
    score = score_drive(drove, expert, modification=setting.modification)
    return {
        "format": FORMAT,
        **asdict(options),
        "score": score.value,
        "kind": NUPLAN,
        **drive_document(drove, {ScoreKind.NUPLAN: score}),
    }
