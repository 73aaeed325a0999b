from pathlib import Path

import pytest

from augment.errors import InvalidDocument
from augment.formats.documents import read_json


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{", "is not JSON"),
        ("", "is not JSON"),
        ('{"a": 1, "b": 2, "a": 3}', "named twice in one object: 'a'"),
        ('{"a": 1, "\\u001b[2J": 2, "\\u001b[2J": 3}', r"in one object: '\\x1b\[2J'"),
        ("[" * 100_000, "is nested too deeply"),
        ('{"a": ' + "9" * 5000 + "}", "is not JSON"),
    ],
)
def test_a_broken_file_is_named(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "scene.json"
    file.write_text(text)
    with pytest.raises(InvalidDocument, match=sentence) as caught:
        read_json(file, what="scene")
    assert "scene.json" in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidDocument, match=r"gone\.json: No such file"):
        read_json(tmp_path / "gone.json", what="scene")


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidDocument, match="is not JSON"):
        read_json(file, what="scene")


def test_many_doubled_names_are_found_in_one_pass_and_not_all_listed(tmp_path: Path) -> None:
    # A megabyte; counting each name among all took 133 s, so a hung test is the failure.
    file = tmp_path / "scene.json"
    pairs = [f'"{number % 40_000:05}": 1' for number in range(80_000)]
    file.write_text("{" + ",".join(pairs) + "}")
    with pytest.raises(InvalidDocument, match=r"'00000', '00001', .* and 39995 more") as caught:
        read_json(file, what="scene")
    assert len(str(caught.value)) < 200
