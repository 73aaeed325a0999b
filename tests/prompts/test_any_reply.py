"""No text whatever makes the reader raise anything but its own error."""

import contextlib
import math
import random
import time

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from augment.errors import ReplyUnreadable
from augment.prompts.blocks import LONGEST_ANSWER
from augment.prompts.reply import ReadReply, read_reply
from tests.properties import examples
from tests.scenes import scene
from tests.variants.playing import GOOD, agent, answer, block

STREET = scene()
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=12,
)


# How long a draw takes says how busy the computer is, not how good the reader.


def read(text: str) -> ReadReply | None:
    with contextlib.suppress(ReplyUnreadable):
        return read_reply(text, STREET)
    return None


@given(st.text())
@example("{" * 5000)
@example('{"add": [' + "{" * 5000)
@example('{"add": "\ud800"}')
@example('{"remove": ["\\ud800"]}')
@example("/*" * 3000 + '"add":')
def test_any_text(text: str) -> None:
    read(text)


MOTIONS = st.dictionaries(st.sampled_from(["start", "path", "speeds"]), JSON)


@examples(40)
@given(
    st.dictionaries(st.sampled_from([*sorted(agent()), "walk_to"]), JSON)
    | st.builds(dict, motion=JSON | MOTIONS)
)
def test_any_fields_of_an_agent(fields: dict[str, object]) -> None:
    read(answer(block(agent(**fields))))


@pytest.mark.parametrize(
    "unit",
    [
        *("/*", ",/**/", '\\"', '"', "{", "[", "\n", "#", " ", "```\n", "```", "Insights", "* "),
        *(",", ", ", '"add":', '{"add":', "</think>", "//", '{"a":1}', '"a":1,'),
        '{"add":1,"add":2}',
    ],
)
def test_no_answer_leads_a_pattern_astray(unit: str) -> None:
    """A pattern that tries every way to split an answer would take hours; this takes 0.1 s."""
    started = time.process_time()
    for before in ("", '{"add": "', '```json\n{"add":[', 'Insights: "'):
        read(before + unit * (LONGEST_ANSWER // 2 // len(unit)))
    assert time.process_time() - started < 5.0


@pytest.mark.slow
def test_ten_thousand_mutated_answers() -> None:
    rng = random.Random(20_261_121)
    for _ in range(10_000):
        text = list(GOOD)
        for _ in range(rng.randint(1, 6)):
            at = rng.randrange(len(text))
            text[at : at + rng.randint(0, 4)] = rng.choice(
                ["", '"', "{", "}", "[", "]", ",", "\\", "9", "-", "e", "NaN", "`", "\n", "null"]
            )
        got = read("".join(text))
        if got is not None:
            for placed in got.modification.changed:
                assert math.isfinite(placed.x_m + placed.y_m + placed.heading_rad)
