"""An instruction as an intent: all that may change a placement is read, or it is refused.

The way through: `tokens` -> `reading` (rules, longest phrase first) -> `grouping` (which phrase
belongs to which object) -> `assembly` (the typed requests).
"""

from __future__ import annotations

from functools import lru_cache

from augment.errors import InstructionNotUnderstood
from augment.instruction.assembly import requested
from augment.instruction.facts import Purpose
from augment.instruction.grouping import grouped
from augment.instruction.intent import Intent
from augment.instruction.reading import Read, read
from augment.instruction.tokens import Token
from augment.instruction.word_lists import REFUSED

MOST_CHARACTERS = 2000
"""Longer texts are refused unread: the longest sentence of the catalogue has some 250."""


@lru_cache(maxsize=512)
def parse(text: str) -> Intent:
    """What an instruction asks for; remembered, because many contestants get the same one.

    Raises:
        InstructionNotUnderstood: A word that may change the placement has no meaning here,
            something that a placement needs is missing, or two parts contradict each other.
            Nothing is guessed.
    """
    if not text.strip():
        raise InstructionNotUnderstood("The instruction is empty.")
    if len(text) > MOST_CHARACTERS:
        raise InstructionNotUnderstood(
            f"The instruction has {len(text)} characters; at most {MOST_CHARACTERS} are read."
        )
    found = read(text)
    understood = tuple(part.words for part in found.reads if not _is_purpose(part))
    ignored = tuple(part.words for part in found.reads if _is_purpose(part))
    passed = tuple(token.text for token in found.passed)
    strange = sorted((*found.unknown, *found.passed), key=lambda token: token.start)
    if found.unknown:
        raise InstructionNotUnderstood(
            _why(found.unknown),
            understood=understood,
            ignored=tuple(token.text for token in strange),
        )
    try:
        requests, assumed = requested(grouped(found.reads))
    except InstructionNotUnderstood as refusal:
        reason = f"{refusal.reason} {_why(found.passed)}" if found.passed else refusal.reason
        raise InstructionNotUnderstood(reason, understood=understood, ignored=passed) from refusal
    return Intent(
        requests=requests,
        understood=understood,
        ignored=ignored,
        not_understood=passed,
        assumed=assumed,
    )


# Private


def _is_purpose(part: Read) -> bool:
    return all(isinstance(fact, Purpose) for fact in part.facts)


def _why(unknown: tuple[Token, ...]) -> str:
    for token in unknown:
        if token.text in REFUSED:
            return f"“{token.text}”: {REFUSED[token.text]}."
    words = dict.fromkeys(f"“{token.text[:30]}”" for token in unknown)
    shown = ", ".join(list(words)[:8]) + (" and more" if len(words) > 8 else "")
    return f"Not understood: {shown}."
