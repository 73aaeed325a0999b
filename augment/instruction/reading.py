"""A text read by the rules: at each place the longest phrase, from left to right."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from augment.instruction.clauses import aside_at
from augment.instruction.facts import Fact, Kept, Mention, Purpose
from augment.instruction.phrases import Phrase, Tokens
from augment.instruction.quantities import QUANTITY_WORDS
from augment.instruction.rules_mentions import LOOKS, MENTION_RULES
from augment.instruction.rules_place import PLACE_RULES
from augment.instruction.rules_purpose import PURPOSE_RULES
from augment.instruction.rules_roadworks import ROADWORK_RULES
from augment.instruction.rules_side import SIDE_RULES
from augment.instruction.rules_state import STATE_RULES
from augment.instruction.rules_things import THING_RULES
from augment.instruction.rules_walks import WALK_RULES
from augment.instruction.strange import harmless, too_many
from augment.instruction.tokens import Token, tokenize
from augment.instruction.word_lists import BODY_WORDS, FILLERS, MARKS, OTHER_NOUNS
from augment.instruction.wording import SLOT_WORDS, SLOTS

RULES: dict[str, tuple[Phrase, ...]] = {
    **THING_RULES,
    **WALK_RULES,
    **ROADWORK_RULES,
    **PLACE_RULES,
    **SIDE_RULES,
    **STATE_RULES,
    **MENTION_RULES,
    **PURPOSE_RULES,
}
"""Every rule by its name; of equally long readings the first rule's counts."""

_ARTICLES = frozenset({"the", "a", "an"})
_BEGINNINGS = (
    QUANTITY_WORDS
    | _ARTICLES
    | SLOT_WORDS.union(
        word
        for options in RULES.values()
        for option in options
        for piece in option.pieces
        for word in piece.words
    )
)
_KNOWN = FILLERS | _BEGINNINGS
"""Every word of the rules."""

_NOUN_WITHIN = 4
_PLACES_NOTHING = (Mention, Purpose, Kept)


@dataclass(frozen=True, slots=True, kw_only=True)
class Read:
    """A phrase that was read: by which rule, its words as they stand, and what they say."""

    rule: str
    words: str
    facts: tuple[Fact, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadText:
    """A text after all rules.

    Attributes:
        reads: What was read.
        unknown: The words that no rule and no list knows and that may change the meaning.
        passed: The words that no rule knows and that change nothing.
    """

    reads: tuple[Read, ...]
    unknown: tuple[Token, ...]
    passed: tuple[Token, ...]


def read(text: str) -> ReadText:
    """Read a text; strange words that change nothing are left out, and it is read again."""
    whole = tokenize(text)
    looks = [token for at, token in enumerate(whole) if _is_look(whole, at)]
    tokens = tuple(token for token in whole if token not in looks)
    passed: tuple[Token, ...] = ()
    while True:
        reader = _Reader(text, tokens)
        reads = [*reader.reads()]
        left_out = harmless(tokens, tuple(reader.unknown), _KNOWN)
        if not left_out:
            break
        passed += left_out
        tokens = tuple(token for token in tokens if token not in left_out)
    reads += [Read(rule="look", words=token.text, facts=(Purpose(),)) for token in looks]
    unknown = tuple(reader.unknown)
    if not unknown and too_many(whole, passed):
        unknown, passed = passed, ()
    return ReadText(
        reads=tuple(reads),
        unknown=unknown,
        passed=tuple(sorted(passed, key=lambda token: token.start)),
    )


# Private


class _Reader:
    """Reads tokens once from left to right; `unknown` is complete after `reads`."""

    def __init__(self, text: str, tokens: Tokens) -> None:
        self.unknown: list[Token] = []
        self._text = text
        self._tokens = tokens
        self._longest = cache(lambda at: _longest(tokens, at))

    def reads(self) -> list[Read]:
        """What was read, in order."""
        found: list[Read] = []
        at = 0
        while at < len(self._tokens):
            rule, end, facts = self._longest(at)
            aside = aside_at(self._tokens, at, self._places)
            if aside is not None and aside.end > end:
                rule, end, facts = "aside", aside.end, (aside.fact,)
            if rule is None:
                token = self._tokens[at]
                if token.text not in FILLERS and token.text not in MARKS:
                    self.unknown.append(token)
                at += 1
                continue
            found.append(Read(rule=rule, words=self._words(at, end), facts=facts))
            at = end
        return found

    def _words(self, at: int, end: int) -> str:
        return " ".join(self._text[self._tokens[at].start : self._tokens[end - 1].end].split())

    def _places(self, at: int) -> bool:
        """Whether a phrase that places something begins here, behind words without meaning."""
        while at < len(self._tokens) and self._tokens[at].text in FILLERS:
            at += 1
        if at >= len(self._tokens):
            return False
        facts = self._longest(at)[2]
        return bool(facts) and not all(isinstance(fact, _PLACES_NOTHING) for fact in facts)


def _is_look(tokens: Tokens, at: int) -> bool:
    """Whether an adjective without a meaning here stands before a noun."""
    if tokens[at].text not in LOOKS:
        return False
    near = [token.text for token in tokens[at + 1 : at + _NOUN_WITHIN]]
    return any(word in BODY_WORDS or word in OTHER_NOUNS for word in near)


def _by_first_word() -> tuple[dict[str, list[tuple[str, Phrase]]], list[tuple[str, Phrase]]]:
    """The phrases by a word that they can begin with, and those that begin with a slot."""
    by_word: dict[str, list[tuple[str, Phrase]]] = {}
    others: list[tuple[str, Phrase]] = []
    for name, options in RULES.items():
        for option in options:
            words = option.first_words()
            if words is None:
                others.append((name, option))
            else:
                for word in words:
                    by_word.setdefault(word, []).append((name, option))
    return by_word, others


_BY_WORD, _OTHERS = _by_first_word()
_ORDER = {name: number for number, name in enumerate(RULES)}


def _longest(tokens: Tokens, at: int) -> tuple[str | None, int, tuple[Fact, ...]]:
    """The rule that reads furthest from here, or from behind an article that stands here."""
    best: tuple[str | None, int, tuple[Fact, ...]] = (None, at, ())
    if tokens[at].number is None and tokens[at].text not in _BEGINNINGS:
        return best
    begins = (at, at + 1) if tokens[at].text in _ARTICLES else (at,)
    for begin in begins:
        if begin >= len(tokens):
            continue
        options = [*_BY_WORD.get(tokens[begin].text, ()), *_OTHERS]
        for name, option in sorted(options, key=lambda one: _ORDER[one[0]]):
            for end, facts in option.read(tokens, begin, SLOTS):
                if end > best[1] and isinstance(facts, tuple):
                    best = (name, end, facts)
    return best
