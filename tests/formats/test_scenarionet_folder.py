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
    """Two scenarios, the second in a folder beside; the summary names them the other way round."""
    root = tmp_path / "set"
    write(root / "sd_one.pkl", description() | {"id": "one"})
    write(tmp_path / "more" / "sd_two.pkl", description() | {"id": "two"})
    write(root / "dataset_summary.pkl", {"sd_two.pkl": {"id": "two"}, "sd_one.pkl": {}})
    write(root / "dataset_mapping.pkl", {"sd_two.pkl": "../more", "sd_one.pkl": ""})
    return root


@pytest.mark.parametrize(
    ("item", "said"), [(None, "two"), ("0", "two"), ("1", "one"), ("sd_one.pkl", "one")]
)
def test_a_scenario_is_named_by_its_file_or_its_number(
    folder: Path, item: str | None, said: str
) -> None:
    reading = read(folder, item)
    assert f"by ScenarioNet, {said}," in reading.scene.provenance
    assert reading.moment.item == f"sd_{said}.pkl"


def test_moments_are_those_of_all_scenarios(folder: Path) -> None:
    assert recognise(folder) is not None
    found = [(one.item, one.frame) for one in READER.moments(folder, every_s=0.2)]
    assert found == [(f"sd_{name}.pkl", step) for name in ("two", "one") for step in (0, 2)]


def test_a_folder_without_a_summary_is_read_by_its_files(folder: Path) -> None:
    for name in ("dataset_summary.pkl", "dataset_mapping.pkl"):
        (folder / name).unlink()
    assert read(folder).moment.item == "sd_one.pkl"
    (folder / "sd_one.pkl").unlink()
    assert "holds no scenario" in fault_of(folder)


@pytest.mark.parametrize("place", ["../../..", "/etc", "..\0", 7])
def test_a_mapping_that_leads_elsewhere_is_refused(folder: Path, place: object) -> None:
    write(folder / "dataset_mapping.pkl", {"sd_two.pkl": place})
    assert "is not in the data set" in (told := fault_of(folder)) or "has no folder" in told


def test_what_is_not_there_is_named(folder: Path) -> None:
    assert "item: unknown '2'; known: 0, 1" in fault_of(folder, "2")
    assert "'sd_x.pkl' is not in the data set" in fault_of(folder, "sd_x.pkl")
    assert "has no folder" in fault_of(folder, "../set/sd_one.pkl")
    write(folder / "dataset_summary.pkl", [1])
    assert "is no dictionary of file names" in fault_of(folder)
