import csv
import io
from dataclasses import replace
from pathlib import Path

import pytest
from django.core.management import CommandError, call_command

from augment.models import Contestant, GenerationJob, Scenario
from augment.scene.codec import intent_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Intent
from augment.services.scenarios.scenes import LoadedScenario
from tests.jobs import rows

pytestmark = pytest.mark.django_db

UNMET = intent_to_document(Intent(unmet="There is no tram."))


def a_job() -> GenerationJob:
    """Ann is 1 m off in seven scenarios and 3 m in a paraphrase, Ben 2 m; one can't be met.

    Ann refuses that one and one more; Ben overlooks it, and his answer is unreadable.
    """
    job = GenerationJob.objects.create(name="Round 1")
    ann, ben = (rows.add_kind(name, Contestant.Kind.RULE) for name in ("ann", "ben"))
    for number in range(7):
        scenario = rows.add_scenario(f"wish-{number}")
        answer(job, scenario, ann, 1.0)
        answer(job, scenario, ben, 2.0 + 0.1 * number)
    anew = rows.add_scenario(
        "wish-0-p1", paraphrase_of=Scenario.objects.get(slug="wish-0"), language="de"
    )
    answer(job, anew, ann, 3.0)
    never = rows.add_scenario("never", intent=UNMET, intent_origin="authored")
    more = rows.add_scenario("more")
    for scenario in (never, more):
        rows.add_answer(job, scenario, ann)
    rows.add_answer(job, never, ben, state="unreadable")
    return job


def answer(job: GenerationJob, scenario: Scenario, contestant: Contestant, off_m: float) -> None:
    reference = LoadedScenario(scenario).reference
    moved = tuple(replace(one, x_m=one.x_m + off_m) for one in reference.added)
    rows.add_answer(job, scenario, contestant, Modification(added=moved))


def exported(job: GenerationJob, part: str, tmp_path: Path) -> list[dict[str, str]]:
    out = tmp_path / f"{part}.csv"
    call_command("export", "analyses", str(job.code), "--part", part, "--out", str(out))
    return list(csv.DictReader(io.StringIO(out.read_text())))


def test_pairs_wordings_and_refusals_come_as_files(tmp_path: Path) -> None:
    job = a_job()
    (pair,) = exported(job, "pairs", tmp_path)
    assert (pair["first"], pair["second"], pair["scenarios"]) == ("ann", "ben", "7")
    assert float(pair["median_difference_m"]) == pytest.approx(-1.3, abs=0.001)
    assert float(pair["p_wilcoxon"]) == pytest.approx(2 / 2**7)
    (reworded,) = exported(job, "wordings", tmp_path)
    assert float(pair["wish_median_difference_m"]) == pytest.approx(-1.3, abs=0.001)
    assert (reworded["contestant"], reworded["wordings"]) == ("ann", "2")
    assert float(reworded["within_m"]) == pytest.approx(2**0.5, abs=0.001)
    ann, ben = exported(job, "refusals", tmp_path)
    assert (ann["right"], ann["wrong"], ann["precision"], ann["recall"]) == ("1", "1", "0.5", "1")
    assert [ben[name] for name in ("right", "overlooked", "precision", "recall")] == [
        *("0", "1", "", "0")
    ]
    with pytest.raises(CommandError, match="elephants"):
        exported(job, "elephants", tmp_path)
