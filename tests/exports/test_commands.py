from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.core.management import CommandError, call_command
from django.test import Client

from arena.models import Study
from arena.services.people import create_person
from arena.services.studies import close_study
from augment.errors import Conflict, UnknownName
from augment.models import Event
from tests.exports.test_ratings import voted_study
from tests.study_rows import a_study, cast_of, expert

pytestmark = pytest.mark.django_db


def run(*arguments: object) -> str:
    out = io.StringIO()
    call_command(*[str(argument) for argument in arguments], stdout=out, stderr=io.StringIO())
    return out.getvalue()


def open_arguments(**changes: object) -> list[object]:
    cast = cast_of()
    options = {"votes_per_expert": 6, "seed": 1, **changes}
    return [
        "open_study", "Round 1", "--contestants", *cast["contestants"],
        "--scenarios", *cast["scenarios"], "--experts", *cast["experts"],
        "--votes-per-expert", options["votes_per_expert"], "--seed", options["seed"],
    ]  # fmt: skip


def test_a_study_is_opened_closed_rated_and_exported_by_commands(tmp_path: Path) -> None:
    assert "12 matchups for 2 experts" in run(*open_arguments())
    assert run("close_study", "Round 1") == "Closed 'Round 1'.\n"
    assert "There are no votes to rate." in run("rate", "Round 1")
    run("export", "leaderboard", "Round 1", "--format", "json", "--out", tmp_path / "board.json")
    assert json.loads((tmp_path / "board.json").read_text())["study"] == "Round 1"
    assert [path.name for path in tmp_path.iterdir()] == ["board.json"]


def test_open_study_says_what_it_had_to_give_up() -> None:
    cast = cast_of(scenarios=3)
    said = run(
        "open_study", "Small", "--contestants", *cast["contestants"], "--scenarios",
        *cast["scenarios"], "--experts", "eva", "--votes-per-expert", 9, "--seed", 1,
    )  # fmt: skip
    assert "comes again after 2 others instead of 5" in said


def test_rules_that_cannot_be_met_are_a_sentence() -> None:
    with pytest.raises(CommandError, match=r"18 different pairs to show, but each .* judge 99"):
        run(*open_arguments(votes_per_expert=99))
    assert not Study.objects.exists()


def test_rate_prints_the_table_and_takes_a_code() -> None:
    study = voted_study()
    said = run("rate", study.code, "--rounds", 200, "--seed", 3, "--resample", "two-way")
    head, first, *_ = said.splitlines()
    assert head.split() == ["Model", "Rank", "Elo", "95%", "CI", "Votes", "95%", "ranks"]
    assert first.startswith("Ann ")
    assert "in closed form, clustered by experts and scenarios, seed 3" in said


def test_the_same_snapshot_is_written_byte_for_byte(tmp_path: Path) -> None:
    run("rate", voted_study().name)
    for name in ("csv", "json", "latex"):
        for copy in ("one", "two"):
            path = tmp_path / f"{name}-{copy}"
            run("export", "leaderboard", "Round 1", "--format", name, "--out", path)
        one, two = (tmp_path / f"{name}-{copy}" for copy in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()


def test_a_hyphen_is_standard_output() -> None:
    run("rate", voted_study().name)
    assert run("export", "leaderboard", "Round 1", "--out", "-").startswith("rank,model,elo,")
    with pytest.raises(CommandError, match="name a file"):
        run("export", "leaderboard", "Round 1", "--format", "png", "--out", "-")


def test_before_the_first_rating_there_is_nothing_to_export(tmp_path: Path) -> None:
    close_study(study=a_study())
    with pytest.raises(CommandError, match=r"has no rating yet. Rate it first"):
        run("export", "leaderboard", "Round 1", "--out", tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


def test_an_open_study_is_exported_only_on_purpose_and_that_is_logged(tmp_path: Path) -> None:
    a_study()
    run("rate", "Round 1", "--early")
    looks = Event.objects.filter(verb="look early")
    assert looks.count() == 1
    target = ("export", "leaderboard", "Round 1", "--out", tmp_path / "x.csv")
    with pytest.raises(CommandError, match="still open"):
        run(*target)
    run(*target, "--early")
    assert looks.count() == 2
    with (tmp_path / "x.csv").open(newline="") as file:
        assert {row["early"] for row in csv.DictReader(file)} == {"yes"}


def test_a_folder_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    run("rate", voted_study().name)
    with pytest.raises(CommandError, match="can't be written: No such file or directory"):
        run("export", "leaderboard", "Round 1", "--out", tmp_path / "no" / "x.csv")


@pytest.mark.parametrize("command", ["close_study", "rate"])
def test_an_unknown_study_is_refused_with_the_known_ones(command: str) -> None:
    a_study()
    with pytest.raises(CommandError, match=r"Unknown study 'Round 2'. Known: Round 1"):
        run(command, "Round 2")


# --- People ------------------------------------------------------------------------------------


def test_people_get_a_role_and_a_pseudonym_of_their_own() -> None:
    eva, finn = expert("eva"), expert("finn")
    assert (eva.person.pseudonym, finn.person.pseudonym) == ("Expert 1", "Expert 2")
    admin = create_person(username="adi", password="a password", role="admin")
    assert (admin.is_staff, admin.is_superuser, eva.is_staff) == (True, True, False)
    with pytest.raises(Conflict, match="'eva' is taken"):
        expert("eva")
    with pytest.raises(UnknownName, match=r"'boss'. Known: admin, analyst, expert"):
        create_person(username="bo", password=None, role="boss")


@pytest.mark.parametrize("username", ["", "two words", "two\nlines", "n" * 151])
def test_a_username_that_no_form_would_take_is_refused(username: str) -> None:
    with pytest.raises(CommandError, match="person can't be read: username: "):
        run("add_person", username, "--role", "expert")
    assert not User.objects.exists()


@pytest.mark.parametrize("pseudonym", ["", "two\nlines", "n" * 61])
def test_a_pseudonym_that_is_not_one_line_is_refused(pseudonym: str) -> None:
    with pytest.raises(CommandError, match="pseudonym: 1 to 60 printable characters"):
        run("add_person", "eva", "--role", "expert", "--pseudonym", pseudonym)
    assert not User.objects.exists()


def test_votes_and_ratings_can_only_be_read_in_the_admin() -> None:
    study = voted_study()
    run("rate", study.name)
    client = Client()
    client.force_login(create_person(username="adi", password="a password", role="admin"))
    for model in ("vote", "snapshot", "study", "matchup", "person"):
        assert client.get(f"/admin/arena/{model}/").status_code == 200
        assert client.get(f"/admin/arena/{model}/add/").status_code == 403
    votes = study.matchups.first()
    assert votes is not None
    page = client.get(f"/admin/arena/vote/{votes.votes.get().pk}/change/")
    assert page.status_code == 200
    assert b'type="submit"' not in page.content.split(b"</nav>")[-1].split(b"logout-form")[0]
