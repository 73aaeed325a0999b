"""Documents as somebody with a grudge writes them: each is our own error, with a place."""

import math
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import InvalidDocument
from augment.formats.documents import (
    DEEPEST,
    MAX_CHARACTERS,
    MOST_YAML_VALUES,
    read_json,
    read_yaml,
    read_yaml_file,
)
from augment.formats.interplan.file import FURTHEST_FROM_EGO_M
from augment.scene.entities import Scene, without_traffic
from tests.fixtures.shelf import whole_scene
from tests.formats.interplan_files import entries_of


def test_broken_json_is_named(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    for text, sentence in (
        (b"", "is not JSON"),
        (b"\xff\xfe\x00", "is not JSON"),
        (b'{"a": 1, "b": 2, "a": 3}', "named twice in one object: 'a'"),
        (b'{"a": 1, "\\u001b[2J": 2, "\\u001b[2J": 3}', r"in one object: '\\x1b\[2J'"),
        (b"[" * 100_000, "is nested too deeply"),
        (b'{"a": ' + b"9" * 5000 + b"}", "is not JSON"),
        (b'{"a": "\\u0000"}', "NUL"),
    ):
        file.write_bytes(text)
        with pytest.raises(InvalidDocument, match=rf"scene\.json: .*{sentence}"):
            read_json(file, what="scene")


def test_many_doubled_names_are_found_in_one_pass(tmp_path: Path) -> None:
    # A megabyte; counting each name among all took 133 s, so a hung test is the failure.
    file = tmp_path / "scene.json"
    pairs = [f'"{number % 40_000:05}": 1' for number in range(80_000)]
    file.write_text("{" + ",".join(pairs) + "}")
    with pytest.raises(InvalidDocument, match="'00000'"):
        read_json(file, what="scene")


# YAML, of which interPlan's file is the one with a shape of its own

TOKEN = "00000000000000ab"
TOP = "modification_details_dictionary"
LAUGHS = "a0: &a0 [1]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 10)
)


@cache
def scene() -> Scene:
    return without_traffic(whole_scene("plane-tree-street"))


def special(body: str, index: str = '"0"') -> str:
    """A file with one special scenario, whose keys but the type are given."""
    more = f", {body}" if body else ""
    entry = f"{{type: jaywalking_pedestrian{more}}}"
    return f'{TOP}: {{"{TOKEN}": {{special_scenario: {{{index}: {entry}}}}}}}'


HOSTILE = [
    ("- 1", "expected a mapping with interPlan's keys, got list"),
    ("a: [\n", "line 2, column 1: is no plain YAML"),
    ("a: 1\n--- \nb: 2", "line 2, column 1: is no plain YAML"),
    ("a: \x1b[2J", "unacceptable character"),
    ("accel_max: 1.0", f"{TOP}: is missing"),
    (f'{TOP}: {{"{TOKEN}": {{}}}}', "holds no special scenario"),
    (f"{TOP}: {{1234567e: {{}}}}", "should match pattern"),
    (f'{TOP}: {{"../../etc/passwd": {{}}}}', "should match pattern"),
    (special("", index='"../0"'), "should match pattern"),
    (special("", index="100"), "should match pattern"),
    (special("").replace("jaywalking_pedestrian", "parade"), "Input should be 'approaching"),
    (special("cones: [[1]]"), "cones[0][1]: is missing"),
    (special("cones: {a: 1}"), "cones: Input should be a valid list"),
    (special('cones: [["1", 2]]'), "cones[0][0]: Input should be a valid number, got '1'"),
    (special("cones: [[true, 2]]"), "cones[0][0]: Input should be a valid number, got True"),
    (special("cones: [[.nan, 2]]"), "cones[0][0]: Input should be a finite number, got nan"),
    (special("cones: [[1.0e+300, 2]]"), "cones[0][0]: Input should be less than"),
    (special(f"cones: [[{'9' * 5000}, 2]]"), "is no plain YAML: Exceeds the limit"),
    (special("pedestrian: [[0, 0, 1, 1, -1]]"), "pedestrian[0][4]"),
    (special(f"cones: [{', '.join(['[0, 0]'] * 1001)}]"), "cones: List should have at most 1000"),
    (special("type: avoid_crashed_cars"), "a key is a text, and stands once"),
    ("? [a, b]\n: 1", "line 1, column 3: is no plain YAML: a key is a text"),
    (LAUGHS, "line 1, column 5: is no plain YAML: anchors, aliases"),
    ("a: {b: 1}\nc: {<<: *a}", "anchors, aliases"),
    ("a: !!python/object/apply:os.system [ls]", "anchors, aliases and tags"),
    ("a: !!binary aGk=", "anchors, aliases and tags"),
    ("[" * 100_000, f"has more than {DEEPEST} levels"),
    ("- " * 100_000, f"has more than {DEEPEST} levels"),
    (f"a: [{'1,' * (MOST_YAML_VALUES + 1)}]", f"and {MOST_YAML_VALUES} values"),
    ("#" * (MAX_CHARACTERS + 1), "characters; at most"),
    ("a: \ud800", ""),
]


@pytest.mark.parametrize(("text", "said"), HOSTILE, ids=range(len(HOSTILE)))
def test_a_hostile_file_is_our_own_error_and_says_where(text: str, said: str) -> None:
    with pytest.raises(InvalidDocument) as caught:
        entries_of(text, {TOKEN: scene()})
    assert said in str(caught.value)
    assert len(str(caught.value)) < 2_000


@given(
    st.lists(
        st.sampled_from(
            [
                *"[]{}&*!|>?:-,#%@`\"' \n",
                *("a", "1", ".nan", "<<: ", TOP, "0x", "2020-99-99", "1:1:1"),
            ]
        )
    ).map("".join)
)
def test_no_text_breaks_the_reader(text: str) -> None:
    try:
        read_yaml(text, what="interPlan file")
    except InvalidDocument:
        return


def test_plain_values_are_read_and_nothing_is_made_a_date() -> None:
    for text, value in (
        ("a: 2020-01-01", {"a": "2020-01-01"}),
        ("a: {<<: 1}", {"a": {"<<": 1}}),
        ("a: 1.5e-3", {"a": 0.0015}),
        ("a: [1, -2.5, null, true, text]", {"a": [1, -2.5, None, True, "text"]}),
    ):
        assert read_yaml(text, what="file") == value


def test_depth_has_a_last_value_that_is_read() -> None:
    deepest = "[" * DEEPEST + "]" * DEEPEST
    assert read_yaml(deepest, what="file") is not None
    with pytest.raises(InvalidDocument):
        read_yaml(f"[{deepest}]", what="file")


@pytest.mark.parametrize(("away_m", "is_read"), [(-0.5, True), (0.5, False)])
def test_what_is_nowhere_near_its_scene_is_refused(away_m: float, is_read: bool) -> None:
    pose = scene().origin.pose
    x_m = pose.x_m + FURTHEST_FROM_EGO_M + away_m
    text = special(f"cones: [[{pose.x_m}, {pose.y_m}], [{x_m}, {pose.y_m}]]")
    if is_read:
        ((found, _),) = entries_of(text, {TOKEN: scene()})
        far = found.added[1]
        assert math.hypot(far.x_m, far.y_m) == pytest.approx(999.5)
    else:
        with pytest.raises(InvalidDocument, match=r"cones\[1\]: is 100[01] m from the ego"):
            entries_of(text, {TOKEN: scene()})


def test_a_large_file_is_refused_unread(tmp_path: Path) -> None:
    file = tmp_path / "large.yaml"
    with file.open("wb") as out:
        out.truncate(MAX_CHARACTERS + 1)
    with pytest.raises(InvalidDocument, match=r"large\.yaml: 4194305 bytes; at most 4194304"):
        read_yaml_file(file, what="interPlan file")
