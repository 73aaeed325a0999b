"""Several samples of a cell: rows, tables, files and the page of the job."""

import math
from dataclasses import replace

import pytest

from arena.jobs.exports.tables import JOB_FILES, repeat_sheet
from arena.results.exports.sheets import find_cells
from augment.errors import UnknownName
from augment.models import Augmentation, GenerationJob
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.judging.analyses import repeatability
from augment.services.running import jobs
from augment.services.running.jobs import JobRequest
from tests.jobs.rows import TWO_CONES, add_kind, add_scenario

pytestmark = pytest.mark.django_db


def moved(by_m: float) -> dict[str, object]:
    cones = tuple(replace(one, x_m=one.x_m + by_m) for one in TWO_CONES.added)
    return dict(modification_to_document(Modification(added=cones)))


def job() -> GenerationJob:
    """Two contestants, scenarios and samples; one of the four answers of `b` is unreadable."""
    for slug in ("a", "b"):
        add_kind(slug)
    for slug in ("street", "lane"):
        add_scenario(slug)
    made = jobs.launch(
        JobRequest(name="J", contestants=["a", "b"], scenarios=["street", "lane"], samples=2)
    )
    done = Augmentation.State.DONE
    places = {("street", 1): 0.3, ("street", 2): 0.5, ("lane", 1): 0.1, ("lane", 2): 0.5}
    for (scenario, sample), by_m in places.items():
        cells = made.augmentations.filter(scenario__slug=scenario, sample=sample)
        cells.update(state=done, modification=moved(by_m), image="x.png")
    lost = made.augmentations.filter(contestant__slug="b", scenario__slug="lane", sample=2)
    lost.update(state=Augmentation.State.UNREADABLE, modification=None, reason="Sorry?")
    made.augmentations.filter(contestant__slug="a").update(options={"seed": 4})
    return made


def test_a_job_has_a_row_for_every_sample() -> None:
    made = job()
    assert made.augmentations.count() == 8
    chosen = {"scenarios": ["street"], "contestants": ["b", "a"]}
    cells = find_cells(made, sample=2, **chosen)
    assert [cells["street", slug].sample for slug in ("b", "a")] == [2, 2]
    with pytest.raises(UnknownName, match="sample of this job '3'"):
        find_cells(made, sample=3, **chosen)


def test_what_varies_between_samples() -> None:
    made = job()
    first, second = repeatability(made)
    # By hand: means over the matched objects of each sample.
    assert first["displacement_m_values"] == pytest.approx((0.2, 0.5))
    assert first["displacement_m_mean"] == pytest.approx(0.35)
    assert first["displacement_m_sd"] == pytest.approx(math.sqrt(2) * 0.15)
    # Variances 0.02 and 0.08, pooled over one degree of freedom each.
    assert first["within_m"] == pytest.approx(math.sqrt(0.05))
    assert (first["missed_mean"], first["missed_sd"]) == (0.0, 0.0)
    assert second["missed_values"] == (0.0, 0.5)
    assert second["displacement_m_values"] == pytest.approx((0.2, 0.5))
    assert first["usd_mean"] is None
    line = JOB_FILES["repeats"].formats["csv"].write(repeat_sheet(made)).decode().splitlines()[1]
    distances = "0.35,0.212132,0.2 0.5"
    assert line == f"a,a,no,2,{distances},0.0,0.0,0 0,,,,0.223607,{distances},0.223607"
