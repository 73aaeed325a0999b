"""A study travels whole and without names; what is not whole is not taken in."""

import csv
import hashlib
import json
import shutil
import sys
import uuid
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from django.apps import apps
from django.contrib.auth.hashers import make_password
from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import CommandError, call_command
from django.utils import timezone
from pytest_django import Settings

from arena.management.backups import EARLIER
from arena.models import Person, Snapshot, Study
from arena.results.exports.tables import leaderboard_table
from arena.results.services.ratings import rate_now as rate
from arena.results.services.stored_rows import as_line, find_filled_tables, list_columns
from arena.studies.services.opening import close_study
from augment.models import Augmentation, Contestant, Endpoint, GenerationJob, Scenario, Simulation
from augment.services.scenarios.pictures import film_document
from tests.moving import a_moving_study
from tests.study_rows import a_study, hang, matchups_of, scenario, vote, write_changes

pytestmark = pytest.mark.django_db(transaction=True)

PNG = b"\x89PNG picture"


@pytest.fixture
def study(tmp_path: Path, settings: Settings) -> Study:
    """Closed and rated; Eva has changed her mind once, Finn has left pairs open.

    One of its scenarios says in other words the last of four follow-ups that stand in none of
    them.
    """
    settings.MEDIA_ROOT = tmp_path / "media"
    made = a_study()
    said = None
    for place in range(4):
        step = scenario(f"said-{place}")
        Scenario.objects.filter(pk=step.pk).update(follows=said)
        said = step
    Scenario.objects.filter(slug="place-0").update(paraphrase_of=said)
    first, second, third, *_ = matchups_of(made, "eva")
    earlier = vote(first, "left", comment="hm; =1+1")
    vote(first, "right", supersedes=earlier.key)
    vote(second, "skip", reason="unclear")
    vote(third, "equal", aids={"zoom"})
    vote(matchups_of(made, "finn")[0], "left")
    drawn = Augmentation.objects.latest("pk")
    hang(drawn, f"bev/2-0a1b2c3d/{'0' * 64}.png")
    for row in Augmentation.objects.all():
        default_storage.save(row.image, ContentFile(PNG))
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    write_changes()
    close_study(study=made)
    made.refresh_from_db()
    rate(study=made, rounds=20)
    return made


def export(study: Study, out: Path) -> dict[str, bytes]:
    call_command("export", "study", study.name, "--out", str(out))
    return tree(out)


def tree(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def empty() -> None:
    for row in Augmentation.objects.all():
        default_storage.delete(row.image)
    call_command("flush", interactive=False, verbosity=0)


def test_export_import_and_export_give_the_same_folder(study: Study, tmp_path: Path) -> None:
    first = export(study, tmp_path / "first")
    empty()
    call_command("import", "study", str(tmp_path / "first"))
    again = Study.objects.get(name=study.name)
    assert export(again, tmp_path / "second") == first
    assert {expert.username for expert in again.experts.all()} == {"expert-0001", "expert-0002"}


def test_films_travel_and_play_over_what_they_played_over(
    tmp_path: Path, settings: Settings
) -> None:
    settings.MEDIA_ROOT = tmp_path / "media"
    made = a_moving_study(scenarios=1, votes=3)
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    close_study(study=made)
    first = export(made, tmp_path / "first")
    empty()
    shutil.rmtree(settings.MEDIA_ROOT)
    call_command("import", "study", str(tmp_path / "first"))
    assert export(Study.objects.get(name=made.name), tmp_path / "second") == first
    for row in Augmentation.objects.all():
        film = film_document(row.image)
        assert film is not None
        assert default_storage.exists(film["ground"])


def test_only_pseudonyms_travel(study: Study, tmp_path: Path) -> None:
    pseudonyms = {expert.person.pseudonym for expert in study.experts.all()}
    Person.objects.update(preferences={"theme": "own-theme"})
    files = export(study, tmp_path / "out")
    for secret in (b'"eva"', b'"finn"', b"pbkdf2", b"md5$", b"own-theme"):
        assert [name for name, content in files.items() if secret in content] == []
    assert all(name.encode() in files["pairs.csv"] for name in pseudonyms)


def test_every_vote_and_every_pair_without_one_is_a_line(study: Study, tmp_path: Path) -> None:
    files = export(study, tmp_path / "out")
    lines = list(csv.DictReader(files["pairs.csv"].decode().splitlines()))
    assert len(lines) == study.matchups.count() + 1, "one was changed"
    voted = [line for line in lines if line["vote"]]
    assert sorted(line["outcome"] for line in voted) == ["equal", "left", "left", "right", "skip"]
    (changed,) = (line for line in lines if line["supersedes"])
    assert changed["supersedes"] in {line["vote"] for line in voted}
    (skipped,) = (line for line in lines if line["outcome"] == "skip")
    assert skipped["skip_reason"] == "unclear"
    assert {line["aids"] for line in voted} == {"", "zoom"}
    assert not any(line["comment"].startswith("=") for line in lines)
    codes = {str(row.code) for row in Augmentation.objects.all()}
    assert {line["augmentation_a"] for line in lines} <= codes


def test_the_manifest_names_every_file_with_its_hash(study: Study, tmp_path: Path) -> None:
    files = export(study, tmp_path / "out")
    manifest = json.loads(files.pop("manifest.json"))
    assert manifest["members"] == {
        name: hashlib.sha256(content).hexdigest() for name, content in files.items()
    }
    assert manifest["study"]["seed"] == study.seed
    pictures = {name for name in files if name.startswith("media/")}
    assert pictures == {f"media/{row.image}" for row in Augmentation.objects.all()}
    code = study.snapshots.get().code
    assert {f"ratings/{code}/leaderboard.csv", f"ratings/{code}/votes.csv"} <= files.keys()
    assert {"contestants.json", "augmentations.csv", "README.md"} <= files.keys()


def test_an_open_study_is_not_exported(study: Study, tmp_path: Path) -> None:
    Study.objects.update(state=Study.State.OPEN)
    with pytest.raises(CommandError, match="is open"):
        export(study, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_nothing_is_overwritten_and_nothing_half_written_stays(
    study: Study, tmp_path: Path
) -> None:
    (tmp_path / "out").mkdir()
    with pytest.raises(CommandError, match="is there already"):
        export(study, tmp_path / "out")
    GenerationJob.objects.update(state=GenerationJob.State.RUNNING)
    with pytest.raises(CommandError, match="still runs"):
        export(study, tmp_path / "new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["media", "out"]


def test_only_drives_that_are_over_travel(study: Study, tmp_path: Path) -> None:
    drives = [
        Simulation.objects.create(
            scenario=study.scenarios.all()[0],
            subject=Simulation.Subject.UNMODIFIED,
            planner=f"{state} planner",
            offsets="paper",
            state=state,
            claim=uuid.uuid4() if state == "running" else None,
            heartbeat_at=timezone.now() if state == "running" else None,
        )
        for state in ("queued", "running", "failed")
    ]
    rows = export(study, tmp_path / "out")["rows/augment.simulation.jsonl"]
    assert str(drives[-1].code).encode() in rows
    assert len(rows.splitlines()) == 1


def without(name: str, row: dict[str, Any]) -> dict[str, Any]:
    return {column: row[column] for column in row if column != name}


def craft(folder: Path, label: str, change: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Change the rows of a table as somebody would who also recomputes the hash."""
    path = folder / f"rows/{label}.jsonl"
    columns = [column.attname for column in list_columns(apps.get_model(label))]
    lines = path.read_text().splitlines() if path.exists() else []
    rows = [change(dict(zip(columns, json.loads(line), strict=True))) for line in lines]
    path.write_bytes(b"".join(as_line(list(row.values())) for row in rows))
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["members"][f"rows/{label}.jsonl"] = hashlib.sha256(path.read_bytes()).hexdigest()
    manifest["rows"][label] = len(rows)
    (folder / "manifest.json").write_text(json.dumps(manifest))


def test_nobody_of_a_folder_rules_and_no_key_is_sent_to_it(study: Study, tmp_path: Path) -> None:
    endpoint = Endpoint.objects.create(
        label="away", base_url="https://away.example/v1", key_variable="OPENAI_API_KEY"
    )
    Contestant.objects.filter(pk=study.contestants.all()[0].pk).update(
        kind=Contestant.Kind.LLM, variant="zero-shot", endpoint=endpoint, model="m"
    )
    folder = tmp_path / "out"
    export(study, folder)
    assert b"OPENAI_API_KEY" not in (folder / "rows/augment.endpoint.jsonl").read_bytes()
    empty()
    powers = {"is_staff": True, "is_superuser": True, "password": make_password("a password")}
    craft(folder, "auth.user", lambda row: row | powers)
    craft(folder, "augment.endpoint", lambda row: row | {"key_variable": "OPENAI_API_KEY"})
    call_command("import", "study", str(folder))
    for user in User.objects.all():
        assert (user.is_staff, user.is_superuser) == (False, False)
        assert not user.has_usable_password()
    assert Endpoint.objects.get().key_variable == ""


@pytest.mark.parametrize(
    ("lacking", "variant", "version"),
    [
        (list(EARLIER), "fc-plus+tqa", 2),
        (["augment.0043_fc_plus"], "fc-plus+tqa", 3),
        ([], "fc+tqa", 3),
    ],
)
def test_a_folder_of_an_earlier_release_is_read_and_means_our_function_by_fc(
    study: Study, tmp_path: Path, lacking: list[str], variant: str, version: int
) -> None:
    endpoint = Endpoint.objects.create(label="away", base_url="https://away.example/v1")
    pk = study.contestants.all()[0].pk
    asks = {"variant": "fc+tqa", "endpoint": endpoint, "model": "m", "name": "Llama FC+tQA"}
    Contestant.objects.filter(pk=pk).update(kind=Contestant.Kind.LLM, **asks)
    Simulation.objects.create(
        scenario=study.scenarios.all()[0],
        subject=Simulation.Subject.UNMODIFIED,
        planner="idm",
        offsets="paper",
        state=Simulation.State.FAILED,
        version=3,
    )
    folder = tmp_path / "out"
    export(study, folder)
    empty()
    for column in frozenset[str]().union(*(EARLIER[migration][1] for migration in lacking)):
        label, _, name = column.rpartition(".")
        if (folder / f"rows/{label}.jsonl").exists():
            craft(folder, label, partial(without, name))
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["migrations"] = [one for one in manifest["migrations"] if one not in lacking]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    call_command("import", "study", str(folder))
    assert Contestant.objects.get(pk=pk).variant == variant
    assert Simulation.objects.get().version == version
    notes = leaderboard_table(Snapshot.objects.get()).warnings
    assert (
        "Llama FC+tQA runs FC-plus+tQA: it was named before FC+tQA meant" in str(notes)
    ) is bool(lacking)


def test_a_folder_with_tables_that_no_study_has_is_refused(study: Study, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    export(study, folder)
    empty()
    craft(folder, "auth.user_groups", lambda row: row)
    with pytest.raises(CommandError, match=r"no study has: auth\.user_groups"):
        call_command("import", "study", str(folder))
    assert not Study.objects.exists()


HOSTILE: list[tuple[str, dict[str, Any], str]] = [
    ("augment.simulation", {"state": "queued"}, "state: 'queued' is not over"),
    ("augment.simulation", {"planner": "evil_planner.Planner"}, "not allowed here, only pdm-cl"),
    ("augment.simulation", {"offsets": "wide"}, "offsets: one of paper, original"),
    ("augment.simulation", {"trace": "AAAA"}, "trace: "),
    ("augment.generationjob", {"state": "running"}, "state: 'running' is not over"),
    ("augment.generationjob", {"samples": 9999}, "samples: goes from 1 to"),
    ("augment.augmentation", {"state": "queued"}, "state: 'queued' is not over"),
    ("augment.augmentation", {"image": "../../secret.png"}, "image: '../../secret.png' must be"),
    ("augment.augmentation", {"image": f"/{'0' * 64}.png"}, "must be bev/"),
    ("augment.augmentation", {"modification": {"format": "?"}}, "format: expected"),
    ("augment.basescene", {"document": {}}, "format: expected"),
    ("augment.scenario", {"slug": "a/b"}, "slug: "),
    ("augment.scenario", {"original_image": "uploads/x"}, "original_image: "),
    ("augment.contestant", {"options": {"warmth": 1}}, "warmth: is no option"),
    ("augment.endpoint", {"base_url": "http://169.254.169.254/v1"}, "base_url: 169.254.169.254"),
    ("augment.endpoint", {"max_concurrency": 10**6}, "max_concurrency: "),
    ("arena.study", {"state": "open"}, "state: 'open' is not over"),
    ("arena.study", {"seed": -1}, "A seed goes from 0"),
    ("arena.matchup", {"left_image": "marked/x.png"}, "left_image: 'marked/x.png' must be bev/"),
    ("arena.vote", {"key": 999999}, "key: 999999 is no value of this column"),
    ("arena.vote", {"comment": "x" * 1001}, "at most 1000 characters"),
    ("arena.vote", {"is_simulated": "no"}, "is_simulated: "),
    ("arena.snapshot", {"state": "queued"}, "state: 'queued' is not over"),
    ("arena.snapshot", {"method": "best"}, "'best' is not a valid Method"),
]
"""What the author of a folder writes into a table, and what the refusal says of its first row."""


def test_a_hostile_folder_is_refused_with_its_row_and_imports_nothing(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "evil_planner.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    endpoint = Endpoint.objects.create(label="away", base_url="https://away.example/v1")
    Contestant.objects.filter(pk=study.contestants.all()[0].pk).update(
        kind=Contestant.Kind.LLM, variant="otm", endpoint=endpoint, model="m"
    )
    Simulation.objects.create(
        scenario=study.scenarios.all()[0],
        subject=Simulation.Subject.UNMODIFIED,
        planner="idm",
        offsets="paper",
        state=Simulation.State.FAILED,
    )
    honest = tmp_path / "out"
    export(study, honest)
    empty()
    for label, columns, says in HOSTILE:
        hostile = tmp_path / "hostile"
        shutil.copytree(honest, hostile)
        craft(hostile, label, partial(dict, **columns))
        with pytest.raises(CommandError) as refused:
            call_command("import", "study", str(hostile))
        assert f"rows/{label}.jsonl can't be stored: line 1: " in str(refused.value)
        assert says in str(refused.value), label
        shutil.rmtree(hostile)
    assert "evil_planner" not in sys.modules
    assert find_filled_tables() == []
    pictures = Path(default_storage.path("")).rglob("*.png")
    assert {path.parent.name for path in pictures} <= {"computed"}, "no picture either"
    call_command("import", "study", str(honest))


def test_a_folder_with_a_file_of_a_strange_name_is_refused(study: Study, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    export(study, folder)
    empty()
    (folder / "media/evil").mkdir()
    (folder / "media/evil/x.png").write_bytes(PNG)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["members"]["media/evil/x.png"] = hashlib.sha256(PNG).hexdigest()
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(CommandError, match=r"files that no study has: media/evil/x\.png"):
        call_command("import", "study", str(folder))


def test_a_vote_on_what_its_expert_was_not_shown_is_refused(study: Study, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    export(study, folder)
    other = User.objects.get(username="finn").pk
    empty()
    craft(folder, "arena.vote", lambda row: row | {"expert_id": other})
    with pytest.raises(CommandError, match=r"arena\.vote, row \d+"):
        call_command("import", "study", str(folder))
    assert find_filled_tables() == []
