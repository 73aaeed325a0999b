"""The folder of a benchmark: what is in it, what is not, and how it is read again."""

import json
import os
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from augment.benchmark.folder import FORMATS, checksum, read_folder, write_folder
from augment.benchmark.values import BenchmarkSet, Split, Stratum
from augment.errors import InvalidDocument
from augment.scene.entities import Modification
from augment.scene.intent import Shape
from tests.benchmark.sets import RECORDING, SECRET_M, handed_out, on_disk, small_set
from tests.intents import cones
from tests.scenes import scene, vehicle

Break = Callable[[Path], object]
Change = Callable[[BenchmarkSet], BenchmarkSet]


def first(**changes: Any) -> Change:
    """Another first task, which is for practice."""
    return lambda old: replace(old, tasks=(replace(old.tasks[0], **changes), *old.tasks[1:]))


CHANGES: dict[str, Change] = {
    "title": lambda old: replace(old, title="Small!"),
    "version": lambda old: replace(old, version=3),
    "day": lambda old: replace(old, made_on=date(2026, 11, 27)),
    "order": lambda old: replace(old, tasks=old.tasks[::-1]),
    "number": lambda old: replace(old, tasks=old.tasks[:3]),
    "wording": first(instruction="Park a car ahead."),
    "type": first(type="cut_in"),
    "stratum": first(stratum=Stratum.MEDIUM),
    "split": first(split=Split.TEST),
    "traffic": first(keeps_traffic=False),
    "scene": first(scene=scene(name="near-scene", agents=(vehicle("Agent2", 20.0, 1e-9),))),
    "recording": first(recording=RECORDING),
    "reference": first(reference=Modification(removed=("Agent2",))),
    "intent": first(intent=cones(31.5, 1, Shape.LINE)),
}


@pytest.mark.parametrize("what", CHANGES)
def test_the_checksum_tells_every_change_of_what_is_handed_out(what: str) -> None:
    assert checksum(CHANGES[what](small_set())) != checksum(small_set())


def test_a_checksum_stays_what_it_is() -> None:
    """Benchmarks that are handed out have it: another one here makes all of them unreadable."""
    pinned = "c2c5c4094ac94f93cd736e459ad4fe27afb6717725dd2ec589c16f8d7d114e99"
    assert checksum(small_set()) == pinned
    zeros = [first(reference=Modification(added=(vehicle("A3", 9.0, y),))) for y in (0.0, -0.0)]
    assert len({checksum(change(small_set())) for change in zeros}) == 1, "as databases have it"


def test_what_is_read_again_is_what_was_handed_out(tmp_path: Path) -> None:
    benchmark = CHANGES["intent"](small_set())
    found = read_folder(on_disk(tmp_path, benchmark))
    assert checksum(found) == checksum(benchmark)
    assert found.tasks[0] == benchmark.tasks[0]
    assert found.tasks[3] == handed_out(benchmark).tasks[3]
    # A recording is compared by its numbers, which the checksum holds.
    bare = [replace(one, recording=None) for one in found.tasks]
    assert bare == [replace(one, recording=None) for one in handed_out(benchmark).tasks]
    # A pickle also says which of its texts are one object.
    before, after = (
        {name: content for name, content in write_folder(one).items() if ".pkl" not in name}
        for one in (benchmark, found)
    )
    assert after == before, "byte for byte"


def test_every_task_is_there_in_every_format_and_losses_are_listed() -> None:
    files = write_folder(small_set())
    for line in json.loads(files["benchmark.json"])["tasks"]:
        assert {"scene", *FORMATS} - line["files"].keys() == set(), line["name"]
        assert all(set(named) <= files.keys() for named in line["files"].values())
    assert json.loads(files["benchmark.json"])["tasks"][1]["files"]["commonroad"] == [
        "commonroad/far.xml"
    ]
    losses = json.loads(files["losses.json"])
    assert {"format", "cell", "text", "changes_scene", "is_refused"} == losses[0].keys()
    readme = files["README.txt"].decode()
    assert all(
        text in readme for text in (checksum(small_set()), "authors (a list", "models (a list")
    )
    assert [name for name in files if name.startswith("references/")] == ["references/near.json"]


def test_no_byte_tells_of_a_reference_of_the_test() -> None:
    """Whatever the references say, the bytes are the same; nor does a number of them appear."""
    benchmark = small_set()
    files = write_folder(benchmark)
    other = [
        one if one.split is Split.PRACTICE else replace(one, reference=Modification())
        for one in benchmark.tasks
    ]
    assert write_folder(replace(benchmark, tasks=tuple(other))) == files
    assert not [name for name, content in files.items() if str(SECRET_M)[:6].encode() in content]


def test_practice_without_a_reference_is_refused() -> None:
    with pytest.raises(InvalidDocument, match="near: is for practice and has no reference"):
        write_folder(first(reference=None)(small_set()))


# What is wrong with a folder


def edit(name: str, *steps: Any, to: Any) -> Callable[[Path], None]:
    """Put something else at a place of a JSON file."""

    def change(folder: Path) -> None:
        document = part = json.loads((folder / name).read_text())
        for step in steps[:-1]:
            part = part[step]
        part[steps[-1]] = to
        (folder / name).write_text(json.dumps(document))

    return change


def link(folder: Path) -> None:
    (folder / "scenes" / "near.json").rename(folder / "elsewhere.json")
    (folder / "scenes" / "near.json").symlink_to(folder / "elsewhere.json")


def link_folder(folder: Path) -> None:
    (folder / "scenes").rename(folder / "elsewhere")
    (folder / "scenes").symlink_to(folder / "elsewhere")


def grow(folder: Path) -> None:
    os.truncate(folder / "scenes" / "near.json", 600 << 20)


MANIFEST = "benchmark.json"
BROKEN: dict[str, tuple[Break, str]] = {
    "nothing": (lambda folder: (folder / MANIFEST).unlink(), "benchmark.json: is missing"),
    "not JSON": (
        lambda folder: (folder / MANIFEST).write_text("{"),
        "benchmark.json: is not JSON",
    ),
    "format": (edit(MANIFEST, "format", to="x"), "format: expected 'scenario-arena/benchmark'"),
    "version": (edit(MANIFEST, "version", to=2), "version: version 2 is not known"),
    "new key": (edit(MANIFEST, "licence", to="x"), "licence: is not a field"),
    "day": (edit(MANIFEST, "made_on", to=20261126), "made_on: Input should be a date such as"),
    "split": (edit(MANIFEST, "tasks", 0, "split", to="dev"), "tasks[0].split: Input should be"),
    "path": (edit(MANIFEST, "tasks", 0, "name", to="../up"), "tasks[0].name: String should match"),
    "twice": (edit(MANIFEST, "tasks", 1, "name", to="near"), "tasks[1].name: 'near' is there"),
    "paraphrase": (edit(MANIFEST, "tasks", 2, "paraphrase_of", to="x"), "'x' is no task"),
    "elsewhere": (
        edit(MANIFEST, "tasks", 0, "files", "scene", to=["/etc/passwd"]),
        "tasks 'near': files.scene: expected 'scenes/near.json' alone",
    ),
    "secret": (
        edit(MANIFEST, "tasks", 1, "files", "reference", to=["references/far.json"]),
        "tasks 'far': files: of a test task expected scene",
    ),
    "secret intent": (
        edit(MANIFEST, "tasks", 1, "files", "intent", to=["intents/far.json"]),
        "tasks 'far': files: of a test task expected scene",
    ),
    "provenance": (edit(MANIFEST, "tasks", 0, "provenance", to="x"), "provenance: is not that"),
    "wording": (edit(MANIFEST, "tasks", 0, "instruction", to="x"), "benchmark.json: checksum"),
    "scene": (edit("scenes/far.json", "ego", "x_m", to="0"), "scenes/far.json: ego.x_m: Input"),
    "gone": (
        lambda folder: (folder / "scenes" / "far.json").unlink(),
        "scenes/far.json: is missing",
    ),
    "reference": (
        edit("references/near.json", "remove", to=["Agent9"]),
        "tasks 'near': reference: Agent9 is not in the scene",
    ),
    "link": (link, "scenes/near.json: is missing, or is a link"),
    "link to a folder": (link_folder, "scenes/near.json: is missing, or is a link"),
    "too large": (grow, "scenes/near.json: 629145600 bytes; at most"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_what_breaks_a_folder_is_named_with_its_file_and_place(what: str, tmp_path: Path) -> None:
    folder = on_disk(tmp_path, small_set())
    breaks, reason = BROKEN[what]
    breaks(folder)
    with pytest.raises(InvalidDocument, match=re.escape(reason)):
        read_folder(folder)
