import pickle
from pathlib import Path

import pytest

from augment.errors import InvalidDocument
from augment.formats.readers import recognise
from augment.formats.reading import Reading
from augment.formats.scenarionet.scenario import ScenarioNet
from tests.formats.test_scenarionet import description

READER = ScenarioNet()


def read(folder: Path, item: str | None = None) -> Reading:
    return READER.read(folder, item=item, frame=0, name="made")


def fault_of(folder: Path, item: str | None = None) -> str:
    with pytest.raises(InvalidDocument) as caught:
        read(folder, item)
    return str(caught.value)


def write(file: Path, value: object) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(pickle.dumps(value, protocol=4))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two scenarios, the second in a folder of its own, and an index that nobody needs."""
    root = tmp_path / "set"
    write(root / "sd_one.pkl", description() | {"id": "one"})
    write(root / "more" / "sd_two.pkl", description() | {"id": "two"})
    write(root / "dataset_summary.pkl", [1])
    return root


@pytest.mark.parametrize(("item", "said"), [(None, "two"), ("sd_one.pkl", "one")])
def test_a_scenario_is_named_by_its_file(folder: Path, item: str | None, said: str) -> None:
    assert recognise(folder) is not None
    reading = read(folder, item)
    assert f"by ScenarioNet, {said}," in reading.scene.provenance
    assert reading.moment.item == f"sd_{said}.pkl"


def test_moments_are_those_of_all_scenarios(folder: Path) -> None:
    found = [(one.item, one.frame) for one in READER.moments(folder, every_s=0.2)]
    assert found == [(f"sd_{name}.pkl", step) for name in ("two", "one") for step in (0, 2)]


def test_what_is_not_there_is_named(folder: Path) -> None:
    for item in ("sd_x.pkl", "../set/sd_one.pkl"):
        assert "item: unknown" in (told := fault_of(folder, item))
        assert "known: sd_two.pkl, sd_one.pkl" in told
