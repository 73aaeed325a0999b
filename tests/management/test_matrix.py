"""A matrix of runs in a file: checked as a whole, estimated, launched, and written back."""

from __future__ import annotations

from pathlib import Path

import pytest
from django.core.management import CommandError, call_command

from augment.errors import InvalidDocument
from augment.formats.documents import read_yaml
from augment.models import Contestant, Event, GenerationJob
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.running.matrix import load_matrix, matrix_text
from tests.jobs.rows import add_scenario

pytestmark = pytest.mark.django_db

WHOLE = """
name: Protocols
samples: 2
models:
  - {endpoint: here, model: small}
  - {endpoint: here, model: large}
variants: [otm, fc]
options:
  - {}
  - {only: [fc], set: {protocol: native, temperature: 0.7}}
contestants: [reference]
scenarios: [street, lane]
"""


@pytest.fixture(autouse=True)
def rows() -> None:
    ensure_endpoint(label="here", base_url="http://127.0.0.1:1/v1")
    for slug in ("street", "lane"):
        add_scenario(slug)


def written(folder: Path, text: str) -> str:
    file = folder / "matrix.yaml"
    file.write_text(text)
    return str(file)


def test_a_dry_run_says_all_and_keeps_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = Contestant.objects.count(), Event.objects.count()
    call_command("generate", "--matrix", written(tmp_path, WHOLE), "--dry-run")
    said = capsys.readouterr().out
    # Two models x (two variants, and one of them twice), beside the reference; x 2 x 2.
    assert "28 to run, 24 of them ask models." in said
    assert "Would be added: small-fc-t0p7-native." in said
    assert "a guess from its prompts" in said
    assert "In all: calls 40 expected (24 to" in said
    assert "of 6 contestants unknown" in said
    assert (Contestant.objects.count(), Event.objects.count()) == before
    assert not GenerationJob.objects.exists()


def test_it_is_loaded_once_and_found_again() -> None:
    first = load_matrix(read_yaml(WHOLE, what="matrix"))
    assert first.made == (
        *("small-otm", "small-fc", "small-fc-t0p7-native"),
        *("large-otm", "large-fc", "large-fc-t0p7-native"),
    )
    assert first.contestants == (*first.made, "reference")
    assert (first.scenarios, first.samples, first.name) == (("street", "lane"), 2, "Protocols")
    native = Contestant.objects.get(slug="small-fc-t0p7-native")
    assert native.options == {"protocol": "native", "temperature": 0.7}
    again = load_matrix(read_yaml(WHOLE, what="matrix"))
    assert (again.made, again.contestants) == ((), first.contestants)


def test_every_error_is_told_with_its_place_and_nothing_is_made(tmp_path: Path) -> None:
    wrong = """
models: [{endpoint: there, model: m}, {endpoint: here, model: m}]
variants: [otm, xyz]
options: [{set: {temperature: 3}}, {set: {protocol: native}}]
contestants: [nobody]
scenarios: [street, nowhere]
"""
    before = Contestant.objects.count()
    with pytest.raises(CommandError) as refused:
        call_command("generate", "--matrix", written(tmp_path, wrong), "--dry-run")
    said = str(refused.value)
    for words in (
        "models[0] x variants[0] x options[0].temperature: 3 must be a number from 0 to 2",
        "models[0] x variants[0] x options[1].options.protocol: otm calls no function",
        "models[0] x variants[1]",
    ):
        assert words in said
    with pytest.raises(InvalidDocument) as all_of_them:
        load_matrix(read_yaml(wrong, what="matrix"))
    places = {place for place, _ in all_of_them.value.problems}
    assert {"contestants[0]", "scenarios[1]", "models[1] x variants[1] x options[1]"} <= places
    assert Contestant.objects.filter(endpoint__isnull=False).count() == 0
    assert Contestant.objects.count() >= before


def test_what_is_written_is_read_again() -> None:
    loaded = load_matrix(read_yaml(WHOLE, what="matrix"))
    rows = list(Contestant.objects.filter(slug__in=loaded.contestants).select_related("endpoint"))
    text = matrix_text(rows, loaded.scenarios, samples=2, name="Again: #1")
    Contestant.objects.filter(endpoint__isnull=False).delete()
    again = load_matrix(read_yaml(text, what="matrix"))
    assert set(again.contestants) == set(loaded.contestants)
    assert set(again.made) == set(loaded.made)
    assert (again.scenarios, again.samples, again.name) == (loaded.scenarios, 2, "Again: #1")
    changed = text.replace('"temperature": 0.7', '"temperature": 0.8')
    with pytest.raises(InvalidDocument, match="another contestant called 'large-fc-t0p7-native'"):
        load_matrix(read_yaml(changed, what="matrix"))
