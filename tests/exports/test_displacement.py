import csv
import io
from pathlib import Path

import pytest
from django.core.management import call_command

from arena.jobs.exports.displacement import (
    FORMATS,
    DisplacementTable,
    displacement_table,
    object_sheet,
)
from arena.jobs.exports.tables import JOB_TABLES, augmentation_sheet
from augment.models import Augmentation, Contestant, GenerationJob
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification, ScenarioType
from augment.scene.planned_motion import AtTime
from augment.services.judging.displacement import By
from augment.services.scenarios.pictures import store
from tests.jobs import rows
from tests.metrics.test_over_time import starts
from tests.scene.test_planned_motion import two_lanes
from tests.scenes import cone
from tests.web.cast import png

pytestmark = pytest.mark.django_db


def a_job(*, aside_m: float = 2.0) -> GenerationJob:
    """Ann puts the first cone aside and leaves out the second; sim's answers are unreadable."""
    job = GenerationJob.objects.create(name="Round 1")
    ann = rows.add_kind("ann", Contestant.Kind.RULE)
    sim = rows.add_kind("sim", Contestant.Kind.SIMULATED)
    change = Modification(added=(cone("Agent2", 20.0, 0.5 + aside_m),))
    kinds = {"works": ScenarioType.CONSTRUCTION_ZONE, "parked": ScenarioType.NUDGE}
    for slug, kind in kinds.items():
        scenario = rows.add_scenario(slug, type=kind)
        rows.add_answer(job, scenario, ann, change, image=store(png()))
        rows.add_answer(job, scenario, sim, state="unreadable")
    return job


def table(by: By = By.TYPE, **changes: float) -> DisplacementTable:
    return displacement_table(a_job(**changes), by=by)


def lines_of(content: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(content.decode())))


def run(*arguments: object) -> str:
    out = io.StringIO()
    call_command("export", *map(str, arguments), stdout=out, stderr=io.StringIO())
    return out.getvalue()


def test_csv_has_a_line_per_type_and_contestant_and_leaves_the_unknown_empty() -> None:
    found = lines_of(FORMATS["csv"].write(table()))
    assert [(line["group"], line["contestant"]) for line in found] == [
        ("Construction zone", "ann"),
        ("Construction zone", "sim (simulated)"),
        ("Nudge around parked vehicle", "ann"),
        ("Nudge around parked vehicle", "sim (simulated)"),
    ]
    ann, sim = found[:2]
    assert (ann["median_m"], ann["n"], ann["missing"], ann["surplus"]) == ("2.000", "1", "1", "0")
    assert (sim["median_m"], sim["n"], sim["missing"], sim["simulated"]) == ("", "0", "2", "yes")


def test_by_object_there_is_a_row_for_each_object_with_both_places() -> None:
    job = a_job(aside_m=-2.0)
    spare = Modification(
        added=(cone("Agent2", 20.0, -1.5), cone("Agent9", 30.0, 0.0), cone("x", 1, 1))
    )
    row = job.augmentations.get(contestant__slug="ann", scenario__slug="works")
    Augmentation.objects.filter(pk=row.pk).update(modification=modification_to_document(spare))
    found = lines_of(run("displacement", "Round 1", "--by", "object", "--out", "-").encode())
    assert len(found) == 5 + 4
    works = [line for line in found if line["scenario"] == "works"]
    assert [(line["contestant"], line["object"], line["generated"]) for line in works] == [
        *(("ann", "matched", "Agent2"), ("ann", "matched", "Agent9"), ("ann", "surplus", "x")),
        *[("sim", "missing", "")] * 2,
    ]
    first, last = works[0], works[-1]
    places = [first[name] for name in ("reference_y_m", "y_m", "distance_m")]
    assert places == ["0.5000", "-1.5000", "2.0000"]
    assert (first["class"], first["augmentation"]) == ("traffic cone", str(row.code))
    assert (first["simulated"], last["simulated"]) == ("no", "yes")
    assert (last["state"], last["distance_m"]) == ("unreadable", "")


@pytest.mark.slow
@pytest.mark.usefixtures("drawn_anew")
def test_the_same_job_gives_the_same_bytes() -> None:
    job = a_job()
    for name, form in FORMATS.items():
        first, again = (form.write(displacement_table(job, by=By.VARIANT)) for _ in range(2))
        assert (first == again) is True, name
        assert b"2026" not in first[:400], name


def add_moving(job: GenerationJob) -> Augmentation:
    """Bea's car starts a second too late: over 6 s it is 177.5 / 61 m behind, then 5 m."""
    place = rows.add_scenario(
        "cut",
        scene=two_lanes(),
        reference=modification_to_document(starts(AtTime(after_s=2.0))),
        intent=None,
        intent_origin="",
    )
    bea = rows.add_kind("bea", Contestant.Kind.RULE)
    return rows.add_answer(job, place, bea, starts(AtTime(after_s=3.0)))


def test_columns_over_time_appear_where_something_moves() -> None:
    job, table = a_job(), JOB_TABLES["displacement-by-contestant"]
    sheets = {"final_m": object_sheet, "displacement_final_m": augmentation_sheet}
    assert not [name for name, make in sheets.items() if name in make(job).columns]
    assert b"final_m" not in table.formats["csv"].write(table.make(job))
    add_moving(job)
    written = table.formats["csv"].write(table.make(job)).decode()
    lines = {line["slug"]: line for line in csv.DictReader(io.StringIO(written))}
    finals = {slug: line["final_m"] for slug, line in lines.items()}
    assert finals == {"ann": "", "bea": "5.000", "sim": ""}
    assert (lines["bea"]["median_m"], lines["bea"]["at_t0_m"]) == ("2.910", "0.000")
    for name, make in sheets.items():
        sheet = make(job)
        column = list(sheet.columns).index(name)
        cells = [row[column] for row in sheet.rows]
        assert [cell for cell in cells if cell is not None] == [pytest.approx(5.0)]


# The sheet of samples

SHEET = ("samples", "Round 1", "--scenarios", "works", "parked", "--contestants", "sim", "ann")


@pytest.mark.slow
def test_the_sheet_of_samples_has_the_same_bytes_twice(tmp_path: Path) -> None:
    a_job()
    for name, begins in (("sheet.pdf", b"%PDF"), ("sheet.png", b"\x89PNG")):
        made = []
        for _ in range(2):
            run(*SHEET, "--out", tmp_path / name)
            made.append((tmp_path / name).read_bytes())
        assert (made[0] == made[1]) is True
        assert made[0].startswith(begins)
