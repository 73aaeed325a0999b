import unicodedata
from io import StringIO
from pathlib import Path
from unittest.mock import Mock

import pytest
from django.core.management import CommandError, call_command
from django.db import OperationalError
from hypothesis import given
from hypothesis import strategies as st

from arena.management.commands.rate_csv import Command as RateCsv
from arena.management.rate_csv import main as rate_csv
from augment.escaping import escape_controls
from augment.services.terminal import TerminalOutput

CLEAR = "\x1b[2J"
TITLE = "\x1b]0;owned\x07"


def test_what_steers_a_terminal_is_spelt_out() -> None:
    for text, printed in (
        (CLEAR, r"\x1b[2J"),
        (TITLE, r"\x1b]0;owned\x07"),
        ("\x9b31m", r"\x9b31m"),
        ("done\rfailed", r"done\rfailed"),
        ("\b\x7f\0", r"\x08\x7f\x00"),
        ("a\u202etxt.exe", r"a\u202etxt.exe"),
        ("\u2066x\u2069\u200b", r"\u2066x\u2069\u200b"),
        ("a\u2028b", r"a\u2028b"),
        ("\ud800", r"\ud800"),
        ("a\tb\nc", "a\tb\nc"),
        ("Straße 5 · 10 m² → α", "Straße 5 · 10 m² → α"),
    ):
        assert escape_controls(text) == printed


@pytest.mark.slow
@given(st.text())
def test_no_text_steers_a_terminal(text: str) -> None:
    steering = {unicodedata.category(one) for one in escape_controls(text) if one not in "\n\t"}
    assert steering.isdisjoint({"Cc", "Cf", "Cs", "Zl", "Zp"})


@pytest.mark.parametrize("is_django", [True, False])
def test_a_name_in_an_error_of_a_command_is_escaped(
    is_django: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / f"{CLEAR}.csv")
    if is_django:
        with pytest.raises(SystemExit):
            RateCsv().run_from_argv(["manage.py", "rate_csv", file])
    else:
        assert rate_csv([file]) == 1
    printed = capsys.readouterr().err
    assert r"\x1b[2J.csv: No such file" in printed
    assert CLEAR not in printed


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (
            OperationalError("database or disk is full"),
            "The database: .* full; `manage.py doctor`",
        ),
        (OSError(28, "No space left on device"), "No space left on device.$"),
        (OSError(13, "Permission denied", "b.csv"), "b.csv: Permission denied.$"),
    ],
)
def test_what_fails_outside_is_a_sentence(
    monkeypatch: pytest.MonkeyPatch, error: Exception, says: str
) -> None:
    monkeypatch.setattr(
        "arena.management.commands.prepare._lock_database", Mock(side_effect=error)
    )
    with pytest.raises(CommandError, match=f"^{says}"):
        call_command("prepare")


class Terminal(StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("stream", "written"), [(StringIO(), CLEAR), (Terminal(), r"\x1b[2J")])
def test_the_content_of_a_file_is_exact_but_on_a_terminal(stream: StringIO, written: str) -> None:
    TerminalOutput(stream).write_data(CLEAR)
    assert stream.getvalue() == written
