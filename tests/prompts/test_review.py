"""What reviewers answer: read strictly, and nothing but ReplyUnreadable for all the rest."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import ReplyUnreadable
from augment.prompts.reply import read_questions, read_ratings, read_sight, read_verdict
from tests.variants.playing import questions, rating, verdict

READERS: list[Callable[[str], object]] = [
    partial(read_ratings, accepted_from=4.0),
    read_questions,
    read_verdict,
    partial(read_sight, count=4),
]
PIECES = st.sampled_from(
    [
        *'{}[]",: 1\n`\\',
        "```json\n",
        '"ratings"',
        '"feedback"',
        '"questions"',
        '"verdict"',
        "1. ",
        "2) ",
        "NaN",
        rating(2, 2, 2, "a"),
        questions(),
        verdict(),
    ]
)


def test_sections_are_kept_and_the_block_counts() -> None:
    text = "Summary: A road.\n\n**Questions:**\n1. Where?\n\nAnswers:\n1. There.\n\nRatings: 5\n\n"
    review = read_ratings(text + "Review:\n" + rating(5, 5, 4), accepted_from=4.0)
    assert (review.summary, review.questions, review.answers) == (
        "A road.",
        "1. Where?",
        "1. There.",
    )
    assert review.ratings.mean == pytest.approx(14 / 3)


@pytest.mark.parametrize(
    ("said", "read"),
    [
        ("1. In Lane1.\n2. cannot see", {1: "In Lane1.", 2: "cannot see"}),
        ("**1.** Lane1\n 2) no\n3: yes", {1: "Lane1", 2: "no", 3: "yes"}),
        ("1. first\n1. second\n9. far", {1: "first"}),
        ("<think>1. wrong</think>\n1. right", {1: "right"}),
    ],
)
def test_a_viewers_lines_are_read_by_their_numbers(said: str, read: dict[int, str]) -> None:
    assert read_sight(said, 3) == read


@pytest.mark.parametrize("reader", READERS)
def test_a_good_answer_of_another_kind_is_none(reader: Callable[[str], object]) -> None:
    with pytest.raises(ReplyUnreadable):
        reader(json.dumps({"add": [], "move": [], "remove": []}))


@given(st.one_of(st.text(), st.lists(PIECES, max_size=30).map("".join)))
def test_nothing_but_its_own_error_comes_out_of_a_reader(text: str) -> None:
    for reader in READERS:
        with contextlib.suppress(ReplyUnreadable):
            reader(text)
