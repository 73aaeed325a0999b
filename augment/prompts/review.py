"""From what reviewers answer to ratings, questions, answers and verdicts.

Whatever the text, nothing but ReplyUnreadable comes out of here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from augment.errors import ReplyUnreadable
from augment.prompts.blocks import LONGEST_ANSWER, last_object, without_thoughts
from augment.prompts.strict import Strict, validate

FEWEST_QUESTIONS, MOST_QUESTIONS = 3, 8
LONGEST_ENTRY = 1000
MOST_FEEDBACK = 20

_Words = Annotated[str, Field(min_length=1, max_length=LONGEST_ENTRY)]
_Rating = Annotated[int, Field(ge=1, le=5)]


class Correction(Strict):
    """One problem, the reason behind it, and what to do about it."""

    problem: _Words
    reason: _Words
    corrective_action: _Words

    @property
    def sentence(self) -> str:
        """The three on one line."""
        parts = (
            self.problem,
            f"Reason: {self.reason}",
            f"Corrective action: {self.corrective_action}",
        )
        return " ".join(" ".join(parts).split())


class Ratings(Strict):
    """From 1, wrong throughout, to 5, nothing to improve."""

    compliance: _Rating
    realism: _Rating
    logical_consistency: _Rating

    @property
    def mean(self) -> float:
        """Computed here, never by the model."""
        return (self.compliance + self.realism + self.logical_consistency) / 3.0


_Feedback = Annotated[list[Correction], Field(max_length=MOST_FEEDBACK)]


_Remarks = Annotated[list[_Words], Field(max_length=MOST_FEEDBACK)]


class _RatedBlock(Strict):
    ratings: Ratings
    feedback: _Feedback
    remarks: _Remarks = []


class _QuestionBlock(Strict):
    questions: Annotated[
        list[_Words], Field(min_length=FEWEST_QUESTIONS, max_length=MOST_QUESTIONS)
    ]


class _VerdictBlock(Strict):
    verdict: Literal["accept", "feedback"]
    feedback: _Feedback
    remarks: _Remarks = []


@dataclass(frozen=True, slots=True, kw_only=True)
class RatedReview:
    """What the text reviewer found.

    Attributes:
        remarks: What is too small to be corrected, for the record: nobody is told.
        summary, questions, answers: His own words, for the record; empty where he left them out.
    """

    ratings: Ratings
    feedback: tuple[Correction, ...]
    remarks: tuple[str, ...]
    summary: str
    questions: str
    answers: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineerVerdict:
    """What the engineer decided: with feedback it is not accepted; remarks change nothing."""

    feedback: tuple[Correction, ...]
    remarks: tuple[str, ...] = ()

    @property
    def is_accepted(self) -> bool:
        """Whether nothing is to be corrected."""
        return not self.feedback


def read_ratings(answer: str, *, accepted_from: float) -> RatedReview:
    """The text reviewer's ratings and feedback.

    Args:
        answer: The raw text.
        accepted_from: The mean below which there must be feedback.

    Raises:
        ReplyUnreadable: A rating is missing or no whole number from 1 to 5, or there is nothing
            that the modifier could be told.
    """
    found, _ = last_object(answer, frozenset({"ratings", "feedback"}))
    block = validate(_RatedBlock, found)
    if block.ratings.mean < accepted_from and not block.feedback:
        rule = f"feedback: must not be empty where the mean rating is below {accepted_from:g}"
        raise ReplyUnreadable([rule])
    parts = _sections(answer, ("Summary", "Questions", "Answers", "Ratings", "Review"))
    return RatedReview(
        ratings=block.ratings,
        feedback=tuple(block.feedback),
        remarks=tuple(block.remarks),
        summary=parts.get("Summary", ""),
        questions=parts.get("Questions", ""),
        answers=parts.get("Answers", ""),
    )


def read_questions(answer: str) -> tuple[str, ...]:
    """The engineer's questions to the viewer.

    Raises:
        ReplyUnreadable: They are missing, too few or too many.
    """
    found, _ = last_object(answer, frozenset({"questions"}))
    return tuple(validate(_QuestionBlock, found).questions)


def read_verdict(answer: str) -> EngineerVerdict:
    """The engineer's verdict.

    Raises:
        ReplyUnreadable: It is missing, or it and the feedback contradict each other.
    """
    found, _ = last_object(answer, frozenset({"verdict", "feedback"}))
    block = validate(_VerdictBlock, found)
    if (block.verdict == "accept") == bool(block.feedback):
        rule = 'feedback: must be empty with "accept" and must not be empty with "feedback"'
        raise ReplyUnreadable([rule])
    return EngineerVerdict(feedback=tuple(block.feedback), remarks=tuple(block.remarks))


def read_sight(answer: str, count: int) -> dict[int, str]:
    """What the viewer said to each question, by its number; unanswered ones are left out.

    Raises:
        ReplyUnreadable: No line begins with the number of a question.
    """
    if len(answer) > LONGEST_ANSWER:
        raise ReplyUnreadable([f"the answer is longer than {LONGEST_ANSWER} characters"])
    found: dict[int, str] = {}
    for line in without_thoughts(answer).splitlines():
        numbered = re.match(r"[ \t*#_]*([0-9]{1,2})[ \t]*[.):][ \t*]*(\S.*)", line)
        if numbered is None:
            continue
        number, said = int(numbered.group(1)), numbered.group(2).strip(" *")
        if 1 <= number <= count and number not in found and said:
            found[number] = said[:LONGEST_ENTRY]
    if not found:
        raise ReplyUnreadable(["no line begins with the number of a question"])
    return found


def _sections(answer: str, heads: tuple[str, ...]) -> dict[str, str]:
    parts = re.split(
        rf"^[ \t#*_]*({'|'.join(heads)})[ \t#*_]*:[ \t*_]*", answer, flags=re.MULTILINE
    )
    bodies = dict(zip(parts[1::2], parts[2::2], strict=True))
    return {head: body.strip()[:4000] for head, body in bodies.items()}
