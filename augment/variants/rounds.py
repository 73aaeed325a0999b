"""The only loop of the house: modify, review, and back to the modifier with what was found.

In: a `Modifier` (recipe, scene, who is asked) and an instruction. Out: a `Result`, the round that
counts with its review; everything else is in the transcript.

It is bounded by the recipe's regenerations, and every turn of it is in the transcript. A review
never takes a result away: where it is unusable, or a later round can't be read, what the modifier
made before stands, and the notes say so.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from augment.errors import ModelRefused, ReplyUnreadable, ReviewUnusable
from augment.prompts import fill
from augment.prompts.reply import ReadReply
from augment.prompts.vectors import changes_text
from augment.variants.modifier import Draft, Modifier
from augment.variants.recipes import Keep, Recipe
from augment.variants.review import Review, Submission, Verdict
from augment.variants.transcript import NoteKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """One turn: what was made, and what the review said, None without a usable one."""

    number: int
    read: ReadReply
    verdict: Verdict | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """The round that counts.

    Attributes:
        is_accepted: None where nobody reviewed it.
        remark: How it came to count, for people; empty without a review.
    """

    kept: Round
    is_accepted: bool | None
    remark: str


def modify_and_review(modifier: Modifier, instruction: str) -> Result:
    """The rounds of a recipe, and the one that counts.

    Raises:
        ReplyUnreadable: The modifier's first round can't be read.
        ModelRefused: The modifier declined in its first round.
        ModelFault: The wire broke for good.
    """
    review, transcript = modifier.recipe.review, modifier.respondents.transcript
    rounds: list[Round] = []
    remark = ""
    messages = modifier.task(instruction)
    while True:
        number = len(rounds) + 1
        try:
            draft = modifier.draft(messages)
        except (ReplyUnreadable, ModelRefused) as fault:
            if not rounds:
                raise
            transcript.note(NoteKind.ROUND, {"round": number, "fault": str(fault)})
            remark = f"Round {number} brought no modification: {fault}"
            break
        if review is None:
            only = Round(number=1, read=draft.read, verdict=None)
            return Result(kept=only, is_accepted=None, remark="")
        _note_round(modifier, number, draft)
        submission = _submission(modifier, instruction, draft, rounds)
        verdict, remark = _reviewed(review, submission, number)
        rounds.append(Round(number=number, read=draft.read, verdict=verdict))
        if verdict is None or verdict.is_accepted or number >= modifier.recipe.rounds:
            break
        messages = fill.regenerate_messages(
            draft.messages, verdict.feedback, is_measured=verdict.is_measured
        )
    return _result(modifier, rounds, remark)


# --- Private -----------------------------------------------------------------------------------


def _submission(
    modifier: Modifier, instruction: str, draft: Draft, rounds: list[Round]
) -> Submission:
    return Submission(
        ground=modifier.ground,
        instruction=instruction,
        modification=draft.read.modification,
        respondents=modifier.respondents,
        limits=modifier.recipe.limits,
        earlier=rounds[-1].read.modification if rounds else None,
        told=tuple(
            entry for one in rounds if one.verdict is not None for entry in one.verdict.feedback
        ),
        intent=modifier.intent,
    )


def _reviewed(review: Review, submission: Submission, number: int) -> tuple[Verdict | None, str]:
    """The verdict, or None and why there is none."""
    note = partial(submission.respondents.transcript.note, NoteKind.REVIEW)
    try:
        verdict = review.judge(submission)
    except ReviewUnusable as unusable:
        note({"round": number, "review": review.name, "unusable": unusable.reason})
        return None, str(unusable)
    note({"round": number, "review": review.name} | verdict.document)
    return verdict, ""


def _note_round(modifier: Modifier, number: int, draft: Draft) -> None:
    changes = changes_text(modifier.scene, draft.read.modification)
    document = {"round": number, "changes": changes, "mended": draft.read.mended}
    modifier.respondents.transcript.note(NoteKind.ROUND, document)


def _result(modifier: Modifier, rounds: list[Round], remark: str) -> Result:
    kept = _kept(modifier.recipe, rounds)
    accepted = None if kept.verdict is None else kept.verdict.is_accepted
    judgement = "" if kept.verdict is None else f": {kept.verdict.summary}"
    sentence = f"{modifier.recipe.title}: round {kept.number} of {len(rounds)} counts{judgement}."
    if accepted is False:
        sentence += " No round was accepted."
    modifier.respondents.transcript.note(
        NoteKind.KEPT,
        {"round": kept.number, "rounds": len(rounds), "accepted": accepted, "remark": remark},
    )
    parts = (sentence, remark and f"{remark.rstrip('.')}.")
    return Result(kept=kept, is_accepted=accepted, remark=" ".join(part for part in parts if part))


def _kept(recipe: Recipe, rounds: list[Round]) -> Round:
    """The round that counts; an unreviewed last one came after all the feedback and counts."""
    last = rounds[-1]
    if recipe.keep is Keep.LAST or last.verdict is None:
        return last
    return max(rounds, key=_worth)


def _worth(one: Round) -> tuple[tuple[float, ...], int]:
    """Of equally good rounds the last one is best."""
    return (() if one.verdict is None else one.verdict.score), one.number
