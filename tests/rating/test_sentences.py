"""Sentences keep what they were made of, so that others can say them in another language."""

from __future__ import annotations

import json

from augment.sentences import Sentence, fill_sentence, read_sentence, sentence
from tests.rating.votes import by_votes, named, versus


def test_names_are_joined_and_groups_told_apart() -> None:
    text = "%(number)s of %(groups)s and %(names)s"
    said = sentence(text, number=2, groups=(("a", "b"), ("c",)), names=("d", "e"))
    assert said == "2 of a, b; c and d, e"
    assert fill_sentence("%(names)s", {"names": ("x", "y")}) == "x, y"


def test_a_sentence_survives_json() -> None:
    said = sentence("%(groups)s: %(lost)s", groups=(("a", "b"), ("c",)), lost=3)
    again = read_sentence(json.loads(json.dumps(said.as_document())))
    assert (again, again.text, again.values) == (said, said.text, said.values)


def test_all_that_a_rating_says_can_be_said_again() -> None:
    apart = versus("a", "b", 2, 1, 1) + versus("c", "d", 1, 1, 2) + versus("e", "a", 3, 0, 0)
    board = by_votes(named(apart))
    said = [*board.reasons, *board.warnings, *(line.note for line in board.lines if line.note)]
    assert len(said) > 3
    assert [one for one in said if not isinstance(one, Sentence)] == []
    assert board.explanation == " ".join(board.reasons)
    assert any("The votes set no two bounds for" in one for one in board.reasons)
