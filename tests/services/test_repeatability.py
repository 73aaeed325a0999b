"""Several samples of a cell: rows, tables, files and the page of the job."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import replace

import pytest
from django.core.management import CommandError, call_command
from django.urls import reverse

from arena.queries.jobs import grid
from augment.errors import Conflict, UnknownName
from augment.metrics.repeats import spread_of, within_sd
from augment.models import Augmentation, GenerationJob
from augment.scene.codec import modification_to_document
from augment.scene.modification import Modification
from augment.services.judging.repeatability import repeatability
from augment.services.running import jobs
from augment.services.running.estimates import estimate
from tests.jobs.models import add_llama
from tests.jobs.rows import TWO_CONES, add_kind, add_scenario
from tests.web.cast import people, signed_in

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
    made = jobs.launch(name="J", contestants=["a", "b"], scenarios=["street", "lane"], samples=2)
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
    assert [len(cells) for row in grid(made).rows for cells in row.samples] == [2, 2, 2, 2]
    assert {cell.sample for row in grid(made, sample=2).rows for cell in row.cells if cell} == {2}
    with pytest.raises(UnknownName, match="sample of this job '3'"):
        grid(made, sample=3)


@pytest.mark.parametrize("samples", [0, -1, 101])
def test_samples_have_bounds(samples: int) -> None:
    add_kind("a")
    add_scenario("street")
    with pytest.raises(Conflict, match="from 1 to 100"):
        jobs.launch(name="J", contestants=["a"], scenarios=["street"], samples=samples)


def test_what_varies_between_samples() -> None:
    first, second = repeatability(job())
    # By hand: means over the matched objects of each sample.
    assert first.displacement_m is not None
    assert first.displacement_m.values == pytest.approx((0.2, 0.5))
    assert first.displacement_m.mean == pytest.approx(0.35)
    assert first.displacement_m.sd == pytest.approx(math.sqrt(2) * 0.15)
    # Variances 0.02 and 0.08, pooled over one degree of freedom each.
    assert first.within_m == pytest.approx(math.sqrt(0.05))
    assert first.missed is not None
    assert (first.missed.mean, first.missed.sd) == (0.0, 0.0)
    assert second.missed is not None
    assert second.missed.values == (0.0, 0.5)
    assert second.displacement_m is not None
    assert second.displacement_m.values == pytest.approx((0.2, 0.5))
    assert first.usd is None
    assert first.wrong is not None


def test_spreads_of_little() -> None:
    assert spread_of([]) is None
    one = spread_of([3.0])
    assert one is not None
    assert (one.mean, one.sd) == (3.0, None)
    assert within_sd([[1.0], [2.0]]) is None
    assert within_sd([[1.0, 1.0], [5.0]]) == 0.0


def exported(capsys: pytest.CaptureFixture[str], *what: str) -> str:
    call_command("export", *what, "--out", "-")
    return capsys.readouterr().out


def test_files_name_the_sample(capsys: pytest.CaptureFixture[str]) -> None:
    job()
    rows = list(csv.DictReader(io.StringIO(exported(capsys, "augmentations", "J"))))
    assert [(r["contestant"], r["scenario"], r["sample"]) for r in rows][:3] == [
        ("a", "lane", "1"),
        ("a", "lane", "2"),
        ("b", "lane", "1"),
    ]
    assert rows[0]["options"] == '{"seed": 4}'
    assert float(rows[1]["displacement_mean_m"]) == 0.5
    assert (rows[3]["state"], rows[3]["missing"], rows[3]["reason"]) == (
        "unreadable",
        "2",
        "Sorry?",
    )
    repeats = json.loads(exported(capsys, "repeats", "J", "--format", "json"))["repeats"]
    assert [line["displacement_m_values"] for line in repeats] == ["0.2 0.5", "0.2 0.5"]
    objects = exported(capsys, "displacement", "J", "--by", "object")
    assert {line["sample"] for line in csv.DictReader(io.StringIO(objects))} == {"1", "2"}
    with pytest.raises(CommandError, match="sample of this job '3'"):
        call_command(
            *("export", "samples", "J", "--scenarios", "lane", "--contestants", "a"),
            *("--sample", "3", "--out", "x.pdf"),
        )


def test_the_page_shows_them_and_the_form_launches_them() -> None:
    made = job()
    made.augmentations.filter(state=Augmentation.State.QUEUED).delete()
    admin = signed_in(people()["admin"])
    shown = admin.get(reverse("job", args=[made.code])).content.decode()
    assert "Between 2 samples" in shown
    assert "0.35</b> ± 0.21" in shown
    assert "Findings that are wrong" not in shown
    checked = admin.get(reverse("job", args=[made.code]), {"checks": "1"}).content.decode()
    assert "Findings that are wrong" in checked
    entered = {"name": "K", "contestants": ["a"], "scenarios": ["lane"], "samples": "3"}
    admin.post(reverse("job-new"), entered)
    assert GenerationJob.objects.get(name="K").augmentations.count() == 3
    refused = admin.post(reverse("job-new"), entered | {"samples": "101"})
    assert refused.status_code == 422


def test_an_estimate_counts_samples() -> None:
    add_llama()
    add_scenario("street")
    once = estimate(["llama"], ["street"])
    thrice = estimate(["llama"], ["street"], samples=3)
    assert (once.rows, thrice.rows) == (1, 3)
    assert thrice.calls == tuple(3 * number for number in once.calls)
    assert thrice.tokens_in == 3 * once.tokens_in
