"""A matrix of runs in a file: checked as a whole, estimated, launched, and written back."""

from pathlib import Path

import pytest
from django.core.management import CommandError, call_command

from augment.errors import InvalidDocument
from augment.formats.documents import read_yaml
from augment.models import Contestant, Event, GenerationJob
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.running.matrix import load_matrix
from tests.jobs.rows import add_scenario

pytestmark = pytest.mark.django_db

WHOLE = """
name: Protocols
samples: 2
contestants:
  - reference
  - {slug: small, variant: otm, endpoint: here, model: small}
  - slug: native
    name: Natively
    variant: fc
    endpoint: here
    model: small
    options: {protocol: native, temperature: 0.7}
scenarios: [street, lane]
"""


@pytest.fixture(autouse=True)
def rows() -> None:
    ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
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
    assert "12 to run, 8 of them ask models." in said
    assert "Would be added: native." in said
    assert "a guess from its prompts" in said
    assert "In all: calls 12 expected (8 to" in said
    assert "of 2 contestants unknown" in said
    assert (Contestant.objects.count(), Event.objects.count()) == before
    assert not GenerationJob.objects.exists()


def test_every_error_is_told_with_its_place_and_nothing_is_made(tmp_path: Path) -> None:
    wrong = """
contestants:
  - nobody
  - {slug: hot, variant: otm, endpoint: here, model: m, options: {temperature: 3}}
  - {slug: calls, variant: otm, endpoint: here, model: m, options: {protocol: native}}
  - {slug: good, variant: otm, endpoint: here, model: m}
scenarios: [street, nowhere]
"""
    with pytest.raises(CommandError) as refused:
        call_command("generate", "--matrix", written(tmp_path, wrong), "--dry-run")
    for words in (
        "contestants[0]: 'nobody' is no contestant",
        "contestants[1].temperature: 3 must be a number from 0 to 2",
        "contestants[2].options.protocol: otm calls no function",
        "scenarios[1]: 'nowhere' is no scenario",
    ):
        assert words in str(refused.value)
    assert not Contestant.objects.filter(endpoint__isnull=False).exists()


def test_a_file_is_read_twice_and_makes_its_contestants_once() -> None:
    loaded = load_matrix(read_yaml(WHOLE, what="matrix"))
    assert (loaded.made, loaded.scope.contestants) == (
        ("small", "native"),
        ("reference", "small", "native"),
    )
    assert (loaded.scope.scenarios, loaded.scope.samples, loaded.name) == (
        ("street", "lane"),
        2,
        "Protocols",
    )
    assert load_matrix(read_yaml(WHOLE, what="matrix")).made == ()
    changed = WHOLE.replace("temperature: 0.7", "temperature: 0.8")
    with pytest.raises(InvalidDocument, match="another contestant called 'native'"):
        load_matrix(read_yaml(changed, what="matrix"))
