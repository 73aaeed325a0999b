import json
import shutil
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from tests.fixtures.shelf import FOLDER, HARD_SLUGS, SLUGS, entry

CAR = entry("nudge-plane-tree-street").reference.added[0].id


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of one scenario of the catalogue and its scene."""
    for name in ("scenes/plane-tree-street.json", "scenarios/nudge-plane-tree-street.json"):
        (tmp_path / name).parent.mkdir()
        shutil.copy(FOLDER / name, tmp_path / name)
    return tmp_path


def edit(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    file = folder / "scenarios/nudge-plane-tree-street.json"
    document = json.loads(file.read_text())
    change(document)
    file.write_text(json.dumps(document))


def checked(folder: Path) -> str:
    out = StringIO()
    call_command("check_catalogue", "--folder", str(folder), stdout=out)
    return out.getvalue()


@pytest.mark.slow
def test_the_projects_own_catalogue_is_clean() -> None:
    said = checked(FOLDER)
    assert said.count(" good\n") == len(SLUGS) + len(HARD_SLUGS) == 112
    assert "112 scenarios are as their intents ask for" in said


def test_a_clean_folder_says_how_many_statements_each_intent_makes(folder: Path) -> None:
    assert "nudge-plane-tree-street           7  good" in checked(folder)


def test_a_reference_that_is_elsewhere_than_said_is_refused(folder: Path) -> None:
    edit(folder, lambda it: it["reference"]["add"][0].update(x_m=24.0, y_m=-1.0))
    with pytest.raises(CommandError) as fault:
        checked(folder)
    reasons = str(fault.value)
    assert f"{CAR} ahead along the ego's lane is 24.00 m; 21.5 m is asked for." in reasons
    assert f"{CAR} to the left of the lane's centre is -1.00 m; -1.3 m is asked for." in reasons


def test_a_reference_with_something_wrong_is_refused(folder: Path) -> None:
    edit(folder, lambda it: it["reference"]["add"][0].update(x_m=0.0, y_m=0.0))
    with pytest.raises(CommandError, match=f"wrong: {CAR} and Agent1 overlap"):
        checked(folder)


def test_a_number_that_the_intent_does_not_hold_is_named(folder: Path) -> None:
    edit(folder, lambda it: it.update(instruction="Park a car 19 m ahead of the ego."))
    with pytest.raises(CommandError, match="the instruction says 19, and its intent does not"):
        checked(folder)


@pytest.mark.parametrize(
    ("shift_m", "is_good"), [(0.5, True), (0.51, False), (-0.5, True), (-0.51, False)]
)
def test_a_reference_may_be_half_a_metre_off_along_the_lane(
    folder: Path, shift_m: float, is_good: bool
) -> None:
    edit(folder, lambda it: it["reference"]["add"][0].update(x_m=21.5 + shift_m))
    if is_good:
        assert " good\n" in checked(folder)
    else:
        with pytest.raises(CommandError, match=r"21\.5 m is asked for"):
            checked(folder)
