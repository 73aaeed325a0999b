"""A text read by the rules: at each place the longest phrase, from left to right."""

from __future__ import annotations

from dataclasses import dataclass

from augment.instruction.facts import Fact
from augment.instruction.phrases import Phrase, Tokens
from augment.instruction.rules_place import PLACE_RULES
from augment.instruction.rules_purpose import PURPOSE_RULES
from augment.instruction.rules_roadworks import ROADWORK_RULES
from augment.instruction.rules_things import THING_RULES
from augment.instruction.tokens import Token, tokenize
from augment.instruction.wording import FILLERS, MARKS, SLOTS

RULES: dict[str, tuple[Phrase, ...]] = {
    **THING_RULES,
    **ROADWORK_RULES,
    **PLACE_RULES,
    **PURPOSE_RULES,
}
"""Every rule by its name; of equally long readings the first rule's counts."""

_ARTICLES = frozenset({"the", "a", "an"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Read:
    """A phrase that was read: by which rule, its words as they stand, and what they say."""

    rule: str
    words: str
    facts: tuple[Fact, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadText:
    """A text after all rules: what was read, and the words that no rule and no list knows."""

    reads: tuple[Read, ...]
    unknown: tuple[Token, ...]


def read(text: str) -> ReadText:
    """Read a text; nothing is dropped but the listed filler words and marks."""
    tokens = tokenize(text)
    reads: list[Read] = []
    unknown: list[Token] = []
    at = 0
    while at < len(tokens):
        rule, end, facts = _longest(tokens, at)
        if rule is not None:
            words = " ".join(text[tokens[at].start : tokens[end - 1].end].split())
            reads.append(Read(rule=rule, words=words, facts=facts))
            at = end
            continue
        if tokens[at].text not in FILLERS and tokens[at].text not in MARKS:
            unknown.append(tokens[at])
        at += 1
    return ReadText(reads=tuple(reads), unknown=tuple(unknown))


def _longest(tokens: Tokens, at: int) -> tuple[str | None, int, tuple[Fact, ...]]:
    """The rule that reads furthest from here, or from behind an article that stands here."""
    best: tuple[str | None, int, tuple[Fact, ...]] = (None, at, ())
    begins = (at, at + 1) if tokens[at].text in _ARTICLES else (at,)
    for begin in begins:
        for name, options in RULES.items():
            for option in options:
                for end, facts in option.read(tokens, begin, SLOTS):
                    if end > best[1] and isinstance(facts, tuple):
                        best = (name, end, facts)
    return best
