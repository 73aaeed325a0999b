"""From the export for interPlan to nuPlan's results in the table of drives."""

import csv
import io
import zipfile
from pathlib import Path

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from arena.jobs.exports.driving import FORMATS
from augment.models import Augmentation, BaseScene, Event, GenerationJob, NuplanResult
from augment.services.driving.driving_scores import scores_of_job
from tests.drives import driven
from tests.formats.nuplan_experiment import ran, scored, write_experiment
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db
BASE = "71f182558ee95100"


@pytest.fixture
def job() -> GenerationJob:
    """Two contestants on two scenarios of one scene of nuPlan's."""
    launched = rows.launch(scenarios=2, contestants=("ann", "bob"))
    BaseScene.objects.update(source="nuplan", source_item=BASE)
    launched.augmentations.update(state=Augmentation.State.DONE, **rows.done().columns)
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    return launched


@pytest.fixture
def tokens(job: GenerationJob, tmp_path: Path) -> Path:
    file = tmp_path / "out.zip"
    call_command("export", "scenarios", job.name, "--format", "interplan", "--out", str(file))
    with zipfile.ZipFile(file) as packed:
        return Path(packed.extract("nuplan_tokens.csv", tmp_path))


def run(tokens: Path, *folders: Path) -> list[str]:
    out = io.StringIO()
    given = [str(folder) for folder in folders]
    call_command("import", "nuplan_results", *given, "--tokens", str(tokens), stdout=out)
    return out.getvalue().splitlines()


def names(tokens: Path, who: str) -> list[str]:
    lines = csv.DictReader(io.StringIO(tokens.read_text()))
    return [line["scenario"] for line in lines if line["contestant"] == who]


def test_results_stand_beside_our_drives_and_are_never_among_them(
    job: GenerationJob, tokens: Path, tmp_path: Path
) -> None:
    driven(job)
    first, second = names(tokens, "ann")
    other, failed = names(tokens, "bob")
    report = [ran(first), ran(failed, "AssertionError: no route")]
    strange = scored("ffffffffffffffff-s0", 0.9)
    hit = scored(second, 0.0, no_ego_at_fault_collisions=0.0)
    ann = write_experiment(tmp_path / "a", [scored(first, 0.8), hit, strange], report)
    bob = write_experiment(tmp_path / "b", [scored(other, 1.0)])
    assert run(tokens, ann, bob) == [
        "Left out: ffffffffffffffff-s0 by PDMClosedPlanner: not in nuplan_tokens.csv.",
        "4 results of nuPlan kept, 1 of them failed; 1 left out.",
    ]
    assert Event.objects.get(verb="import nuPlan results").after == {"results": 4}
    before = scores_of_job(job, score="nuplan").lines
    assert {line.driven_by for line in before} == {""}, "interPlan's rules made these scores"
    table = scores_of_job(job, score="interplan")
    *own, ann_line, bob_line = table.lines
    assert [line.mean for line in own] == [line.mean for line in before]
    assert ann_line.name == "ann, driven in nuPlan by PDMClosedPlanner"
    assert (ann_line.mean, ann_line.drives, ann_line.collided) == (0.4, 2, 1)
    assert (bob_line.mean, bob_line.drives, bob_line.failed) == (1.0, 1, 1)
    assert bob_line.before is bob_line.lowered is bob_line.close is None
    assert "ann, driven in nuPlan by PDMClosedPlanner & 40.0 & 2 & -- & --" in (
        FORMATS["latex"].write(table).decode()
    )
    staff = signed_in(people()["researcher"])
    page = staff.get(f"/jobs/{job.code}/driving/?score=interplan").content.decode()
    assert "bob, driven in nuPlan by PDMClosedPlanner" in page
    row = NuplanResult.objects.get(reason__contains="no route").augmentation
    shown = staff.get(f"/augmentations/{row.code}/").content.decode()
    assert "failed (AssertionError: no route)" in shown


def test_a_later_run_replaces_and_a_broken_one_changes_nothing(
    job: GenerationJob, tokens: Path, tmp_path: Path
) -> None:
    first, second = names(tokens, "ann")
    run(tokens, write_experiment(tmp_path / "a", [scored(first, 0.5)]))
    run(tokens, write_experiment(tmp_path / "b", [scored(first, 0.25)]))
    assert [row.score for row in NuplanResult.objects.all()] == [0.25]
    good = write_experiment(tmp_path / "c", [scored(second, 1.0)])
    with pytest.raises(CommandError, match="is there 2 times for the planner"):
        run(tokens, good, good)
    with pytest.raises(CommandError, match="less than or equal to 1"):
        run(tokens, good, write_experiment(tmp_path / "d", [scored(first, 2.0)]))
    assert NuplanResult.objects.count() == 1
    job.augmentations.all().delete()
    said = run(tokens, write_experiment(tmp_path / "e", [scored(first, 0.5)]))
    assert said[0] == f"Left out: {first} by PDMClosedPlanner: its augmentation is not here."
