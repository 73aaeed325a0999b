"""A study travels whole and without names; what is not whole is not taken in."""

import csv
import hashlib
import json
import shutil
import sys
import uuid
from collections.abc import Callable
from dataclasses import dataclass
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
from django.test import override_settings
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
from tests.exports.conftest import without_charts
from tests.moving import a_moving_study
from tests.study_rows import a_study, hang, matchups_of, scenario, vote, write_changes

pytestmark = pytest.mark.django_db(transaction=True)

PNG = b"\x89PNG picture"


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """The folder of a study by its files, and what they were written from."""

    files: dict[str, bytes]
    seed: int
    matchups: int
    pseudonyms: set[str]
    images: dict[str, str]
    """By the code of what they show."""
    rating: str


@pytest.fixture(scope="module")
def exported(django_db_setup: None, django_db_blocker: Any, tmp_path_factory: Any) -> Exported:
    """Closed and rated; Eva has changed her mind once, Finn has left pairs open.

    One of its scenarios says in other words the last of four follow-ups that stand in none of
    them. One drive waits, one runs, one is over. A contestant asks a model with a key.
    """
    folder = tmp_path_factory.mktemp("study")
    with django_db_blocker.unblock(), override_settings(MEDIA_ROOT=folder / "media"):
        made = a_closed_study()
        rate(study=made, rounds=20)
        Person.objects.update(preferences={"theme": "own-theme"})
        add_model_and_drives(made)
        with pytest.MonkeyPatch.context() as patch:
            without_charts(patch)
            files = export(made, folder / "out")
        images = {str(row.code): row.image for row in Augmentation.objects.all()}
        found = Exported(
            files=files,
            seed=made.seed,
            matchups=made.matchups.count(),
            pseudonyms={expert.person.pseudonym for expert in made.experts.all()},
            images=images,
            rating=str(made.snapshots.get().code),
        )
        empty()
    return found


def a_closed_study() -> Study:
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
    hang(Augmentation.objects.latest("pk"), f"bev/2-0a1b2c3d/{'0' * 64}.png")
    for row in Augmentation.objects.all():
        default_storage.save(row.image, ContentFile(PNG))
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    write_changes()
    close_study(study=made)
    made.refresh_from_db()
    return made


def add_model_and_drives(study: Study) -> None:
    endpoint = Endpoint.objects.create(
        label="away", base_url="https://away.example/v1", key_variable="OPENAI_API_KEY"
    )
    asks = {"variant": "fc+tqa", "endpoint": endpoint, "model": "m", "name": "Llama FC+tQA"}
    first = Contestant.objects.filter(pk=study.contestants.all()[0].pk)
    first.update(kind=Contestant.Kind.LLM, **asks)
    for place, state in zip(study.scenarios.all(), ("queued", "running", "failed"), strict=False):
        runs = {"claim": uuid.uuid4(), "heartbeat_at": timezone.now()}
        Simulation.objects.create(
            scenario=place,
            subject=Simulation.Subject.UNMODIFIED,
            planner="idm",
            offsets="paper",
            state=state,
            version=3,
            **runs if state == "running" else {},
        )


@pytest.fixture(autouse=True)
def _no_charts(monkeypatch: pytest.MonkeyPatch) -> None:
    without_charts(monkeypatch)


@pytest.fixture
def folder(exported: Exported, tmp_path: Path) -> Path:
    """The study on disk, before an installation without one."""
    for name, content in exported.files.items():
        (tmp_path / "out" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "out" / name).write_bytes(content)
    return tmp_path / "out"


@pytest.fixture
def study(folder: Path) -> Study:
    call_command("import", "study", str(folder))
    return Study.objects.get()


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


def test_export_import_and_export_give_the_same_folder(
    study: Study, exported: Exported, tmp_path: Path
) -> None:
    assert export(study, tmp_path / "second") == exported.files
    assert {expert.username for expert in study.experts.all()} == {"expert-0001", "expert-0002"}


def test_films_travel_and_play_over_what_they_did(tmp_path: Path, settings: Settings) -> None:
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
        assert default_storage.exists(film["ground"])


def test_only_pseudonyms_travel(exported: Exported) -> None:
    for secret in (b'"eva"', b'"finn"', b"pbkdf2", b"md5$", b"own-theme"):
        assert [name for name, content in exported.files.items() if secret in content] == []
    assert all(name.encode() in exported.files["pairs.csv"] for name in exported.pseudonyms)


def test_every_vote_and_every_pair_without_one_is_a_line(exported: Exported) -> None:
    lines = list(csv.DictReader(exported.files["pairs.csv"].decode().splitlines()))
    assert len(lines) == exported.matchups + 1, "one was changed"
    voted = [line for line in lines if line["vote"]]
    assert sorted(line["outcome"] for line in voted) == ["equal", "left", "left", "right", "skip"]
    (changed,) = (line for line in lines if line["supersedes"])
    assert changed["supersedes"] in {line["vote"] for line in voted}
    (skipped,) = (line for line in lines if line["outcome"] == "skip")
    assert skipped["skip_reason"] == "unclear"
    assert {line["aids"] for line in voted} == {"", "zoom"}
    assert not any(line["comment"].startswith("=") for line in lines)
    assert {line["augmentation_a"] for line in lines} <= exported.images.keys()


def test_the_manifest_names_every_file_with_its_hash(exported: Exported) -> None:
    files = dict(exported.files)
    manifest = json.loads(files.pop("manifest.json"))
    assert manifest["members"] == {
        name: hashlib.sha256(content).hexdigest() for name, content in files.items()
    }
    assert manifest["study"]["seed"] == exported.seed
    pictures = {name for name in files if name.startswith("media/")}
    assert pictures == {f"media/{image}" for image in exported.images.values()}
    rated = {f"ratings/{exported.rating}/{name}.csv" for name in ("leaderboard", "votes")}
    assert rated | {"contestants.json", "augmentations.csv", "README.md"} <= files.keys()


def test_an_open_study_is_not_exported(study: Study, tmp_path: Path) -> None:
    Study.objects.update(state=Study.State.OPEN)
    with pytest.raises(CommandError, match="is open"):
        export(study, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_nothing_is_overwritten_and_nothing_half_written_stays(
    study: Study, tmp_path: Path
) -> None:
    with pytest.raises(CommandError, match="is there already"):
        export(study, tmp_path / "out")
    GenerationJob.objects.update(state=GenerationJob.State.RUNNING)
    with pytest.raises(CommandError, match="still runs"):
        export(study, tmp_path / "new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["media", "out"]


def test_only_drives_that_are_over_travel(exported: Exported) -> None:
    (drive,) = exported.files["rows/augment.simulation.jsonl"].splitlines()
    assert Simulation.State.FAILED in json.loads(drive)


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


def test_nobody_of_a_folder_rules_and_no_key_is_sent_to_it(folder: Path) -> None:
    assert b"OPENAI_API_KEY" not in (folder / "rows/augment.endpoint.jsonl").read_bytes()
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
    folder: Path, lacking: list[str], variant: str, version: int
) -> None:
    for column in frozenset[str]().union(*(EARLIER[migration][1] for migration in lacking)):
        label, _, name = column.rpartition(".")
        if (folder / f"rows/{label}.jsonl").exists():
            craft(folder, label, partial(without, name))
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["migrations"] = [one for one in manifest["migrations"] if one not in lacking]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    call_command("import", "study", str(folder))
    assert Contestant.objects.get(kind=Contestant.Kind.LLM).variant == variant
    assert Simulation.objects.get().version == version
    notes = leaderboard_table(Snapshot.objects.get()).warnings
    assert (
        "Llama FC+tQA runs FC-plus+tQA: it was named before FC+tQA meant" in str(notes)
    ) is bool(lacking)


def test_a_folder_with_tables_or_files_that_no_study_has_is_refused(folder: Path) -> None:
    manifest = (folder / "manifest.json").read_bytes()
    craft(folder, "auth.user_groups", lambda row: row)
    with pytest.raises(CommandError, match=r"no study has: auth\.user_groups"):
        call_command("import", "study", str(folder))
    (folder / "rows/auth.user_groups.jsonl").unlink()
    (folder / "media/evil").mkdir()
    (folder / "media/evil/x.png").write_bytes(PNG)
    document = json.loads(manifest)
    document["members"]["media/evil/x.png"] = hashlib.sha256(PNG).hexdigest()
    (folder / "manifest.json").write_text(json.dumps(document))
    with pytest.raises(CommandError, match=r"files that no study has: media/evil/x\.png"):
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


@pytest.mark.slow
def test_a_hostile_folder_is_refused_with_its_row_and_imports_nothing(
    folder: Path, exported: Exported, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "evil_planner.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("arena.management.backups.call_command", lambda *_, **__: None)  # migrated
    for label, columns, says in HOSTILE:
        craft(folder, label, partial(dict, **columns))
        with pytest.raises(CommandError) as refused:
            call_command("import", "study", str(folder))
        assert f"rows/{label}.jsonl can't be stored: line 1: " in str(refused.value)
        assert says in str(refused.value), label
        for name in ("manifest.json", f"rows/{label}.jsonl"):
            (folder / name).write_bytes(exported.files[name])
    assert "evil_planner" not in sys.modules
    assert find_filled_tables() == []
    pictures = Path(default_storage.path("")).rglob("*.png")
    assert {path.parent.name for path in pictures} <= {"computed"}, "no picture either"
    call_command("import", "study", str(folder))


def test_a_vote_on_what_its_expert_was_not_shown_is_refused(folder: Path) -> None:
    users = (folder / "rows/auth.user.jsonl").read_text().splitlines()
    other = max(json.loads(line)[0] for line in users)
    craft(folder, "arena.vote", lambda row: row | {"expert_id": other})
    with pytest.raises(CommandError, match=r"arena\.vote, row \d+"):
        call_command("import", "study", str(folder))
    assert find_filled_tables() == []
