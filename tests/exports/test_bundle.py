"""A rating as files: everything in one zip, votes for other packages, charts."""

import csv
import hashlib
import io
import json
import zipfile
from pathlib import Path

import pytest
from django.core.management import CommandError, call_command
from pyarrow import parquet

from arena.exports.files import zip_bytes
from arena.models import Snapshot
from arena.results.exports.writers import MANIFEST, bundle_files
from arena.results.queries.votes import Filters
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import product_version
from tests.full_study import Size, full_study
from tests.study_rows import a_study, vote_all

pytestmark = pytest.mark.django_db

SMALL = Size(scenarios=5, experts=3, votes_per_expert=60)


@pytest.fixture
def snapshot() -> Snapshot:
    return rate(study=full_study(size=SMALL), rounds=300, unit="vote", seed=4)


@pytest.mark.slow
@pytest.mark.usefixtures("drawn_anew")
def test_the_zip_is_the_same_twice_its_manifest_true_and_nobody_named(snapshot: Snapshot) -> None:
    packed = zip_bytes(bundle_files(Snapshot.objects.get(pk=snapshot.pk)))
    again = zip_bytes(bundle_files(snapshot))
    assert (packed == again) is True  # of bytes a difference would take minutes to show
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    manifest = json.loads(files.pop("manifest.json"))
    assert set(manifest["files"]) == set(files)
    for name, content in files.items():
        assert manifest["files"][name] == {
            "sha256": hashlib.sha256(content).hexdigest(),
            "bytes": len(content),
        }
    assert manifest["votes"]["sha256"] == hashlib.sha256(files["votes.csv"]).hexdigest()
    assert (manifest["method"]["seed"], manifest["method"]["rounds"]) == (4, 300)
    assert manifest["filters"]["kinds"] == ["main"]
    others = {"python", "numpy", "scipy", "results", "votes"}
    assert set(manifest["versions"]) == others | {"scenario-arena"}
    assert manifest["versions"]["scenario-arena"] == product_version()
    wanted = ("csv", "json", "parquet", "tex", "svg", "pdf", "png")
    assert {f"leaderboard.{suffix}" for suffix in wanted} < set(files)
    person = snapshot.study.experts.order_by("pk")[0].person
    texts = b"".join(files[name] for name in files if not name.endswith(".pdf"))
    assert person.pseudonym.encode() in texts
    for secret in (person.user.username, str(person.code)):
        assert secret.encode() not in texts


@pytest.mark.usefixtures("no_charts")
def test_experts_that_a_rating_is_of_are_named_by_pseudonym() -> None:
    study = vote_all(a_study(votes_per_expert=3))
    person = study.experts.order_by("pk")[0].person
    chosen = Filters(experts=(str(person.code),))
    files = bundle_files(rate(study=study, rounds=10, filters=chosen))
    assert json.loads(files[MANIFEST])["filters"]["experts"] == [person.pseudonym]


@pytest.mark.usefixtures("no_charts")
def test_the_command_writes_the_zip_and_the_same_votes_in_both_formats(
    snapshot: Snapshot, tmp_path: Path
) -> None:
    name = snapshot.study.name
    for what, form in (("votes", "csv"), ("votes", "parquet"), ("leaderboard", "zip")):
        out = tmp_path / f"{what}.{form}"
        call_command("export", what, name, "--format", form, "--out", str(out))
    with zipfile.ZipFile(tmp_path / "leaderboard.zip") as archive:
        assert json.loads(archive.read("manifest.json"))["rating"] == str(snapshot.code)
    text = list(csv.DictReader((tmp_path / "votes.csv").read_text().splitlines()))
    table = parquet.read_table(tmp_path / "votes.parquet").to_pylist()
    assert len(table) == snapshot.votes_counted == 180
    for column in ("model_a", "winner", "ms_visible", "at", "position"):
        assert [line[column] for line in text] == [str(line[column]) for line in table]
    rate(study=snapshot.study, rounds=20, unit="vote")
    out = tmp_path / "older.csv"
    call_command("export", "leaderboard", name, "--rating", str(snapshot.code), "--out", str(out))
    assert b"300 resamples" in out.read_bytes()
    with pytest.raises(CommandError, match=r"'xls'. Known: csv, parquet"):
        call_command("export", "votes", name, "--format", "xls", "--out", "-")
