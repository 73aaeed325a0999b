import io
import json
from pathlib import Path

import pytest
from django.core.management import CommandError, call_command

from arena.models import Study
from tests.exports.test_ratings import voted_study
from tests.study_rows import cast_of

pytestmark = pytest.mark.django_db


def run(*arguments: object) -> str:
    out = io.StringIO()
    call_command(*[str(argument) for argument in arguments], stdout=out, stderr=io.StringIO())
    return out.getvalue()


def open_arguments() -> list[object]:
    cast = cast_of()
    shown = ["--contestants", *cast["contestants"], "--scenarios", *cast["scenarios"]]
    people = ["--experts", *cast["experts"], "--votes-per-expert", 6, "--seed", 1]
    return ["open_study", "Round 1", *shown, *people]


def test_a_study_is_opened_closed_rated_and_exported_by_commands(tmp_path: Path) -> None:
    assert "12 matchups for 2 experts" in run(*open_arguments())
    assert run("close_study", "Round 1") == "Closed 'Round 1'.\n"
    assert "There are no votes to rate." in run("rate", "Round 1")
    run("export", "leaderboard", "Round 1", "--format", "json", "--out", tmp_path / "board.json")
    assert json.loads((tmp_path / "board.json").read_text())["study"] == "Round 1"
    assert {path.name for path in tmp_path.iterdir()} == {"board.json", "media"}


def test_hypotheses_of_a_repeated_option_are_all_frozen() -> None:
    lines = ["Nobody is perfect.", "Nobody is alike.", "Nobody is last."]
    run(*open_arguments(), "--hypotheses", *lines[:2], "--hypotheses", lines[2])
    assert [one["text"] for one in Study.objects.get().rules["hypotheses"]] == lines


def test_a_hyphen_is_standard_output() -> None:
    run("rate", voted_study().name)
    assert run("export", "leaderboard", "Round 1", "--out", "-").startswith("rank,model,elo,")
    with pytest.raises(CommandError, match="name a file"):
        run("export", "leaderboard", "Round 1", "--format", "png", "--out", "-")
