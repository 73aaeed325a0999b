"""Strange words: which of the words that were not read change nothing about a placement.

A strange word is passed over if it is on the list of harmless words, or if its form and its
place make it an adverb ("-ly"), a participle ("-ed", "-ing") or an adjective before a noun that
is known, and if nothing speaks against it: no word of a class that can change a placement
(negation, alternative, comparison, place, quantity, motion), no noun of its own ("an elephant"),
no number or unit beside it. Whatever else is strange is left to be refused.
"""

from __future__ import annotations

from augment.instruction.numbers import NUMBER_WORDS
from augment.instruction.phrases import Tokens
from augment.instruction.quantities import METRES
from augment.instruction.strange_words import NEVER, NEVER_STEMS, SAFE
from augment.instruction.tokens import Token, word_set
from augment.instruction.word_lists import BODY_WORDS, MARKS, OTHER_NOUNS

_MODIFIERS = 3
"""So many adjectives may stand before a noun."""

_SHORTEST_FORM = 5
_BEFORE_NOUN = word_set(
    "a an the this that these those my our your its his her their some any another single one "
    "of with in on at by from to near behind beside for into onto over under along across between "
    "towards toward like and"
)
"""Behind these stands a noun, or an adjective with its noun."""

_BEGINS_NOUN = word_set("a an the this that these those my our your its his her their some")
_MOST_SHARE = 1.0 / 3.0


def harmless(
    tokens: Tokens, unread: tuple[Token, ...], known: frozenset[str]
) -> tuple[Token, ...]:
    """The unread tokens of a text that change nothing about what the others say.

    Args:
        tokens: All tokens of the text, in order.
        unread: Those of them that no rule has read.
        known: The words of the rules: one of these that was not read is no strange word, so its
            form says nothing about it.
    """
    where = {token.start: at for at, token in enumerate(tokens)}
    is_unread = {token.start for token in unread}
    return tuple(
        token
        for token in unread
        if (token.text in SAFE or token.text not in known)
        and _is_harmless(tokens, where[token.start], is_unread)
    )


def too_many(tokens: Tokens, passed: tuple[Token, ...]) -> bool:
    """Whether so many words are passed over that it can't be said what the text is about."""
    words = [token for token in tokens if token.text not in MARKS]
    return len(passed) > max(1.0, _MOST_SHARE * len(words))


# Private


def _is_harmless(tokens: Tokens, at: int, unread: set[int]) -> bool:
    text = tokens[at].text
    if not (text.isascii() and text.isalpha() and len(text) > 1):
        return False
    if text in NEVER or text in NUMBER_WORDS or text in METRES:
        return False
    if _is_modifier(tokens, at, unread):
        return not text.endswith("ing") or text in SAFE
    if _is_noun(tokens, at):
        return False
    if text in SAFE:
        return True
    if text.startswith(NEVER_STEMS) or len(text) < _SHORTEST_FORM:
        return False
    if text.endswith("ly"):
        return not (_measures(tokens, at - 1) or _measures(tokens, at + 1))
    if text.endswith(("ed", "ing")):
        return not _measures(tokens, at - 1) and not _governs(tokens, at)
    return False


def _is_modifier(tokens: Tokens, at: int, unread: set[int]) -> bool:
    """Whether only further strange words stand between this one and a noun that is known."""
    if tokens[at].text.startswith(NEVER_STEMS) and tokens[at].text not in SAFE:
        return False
    if at == 0 or not (
        tokens[at - 1].text in _BEGINS_NOUN
        or _counts(tokens[at - 1])
        or (tokens[at - 1].start in unread and _is_modifier(tokens, at - 1, unread))
    ):
        return False
    for token in tokens[at + 1 : at + 1 + _MODIFIERS]:
        if token.text in BODY_WORDS or token.text in OTHER_NOUNS:
            return True
        if token.text in NEVER or not (token.start in unread or token.text in SAFE):
            return False
    return False


def _is_noun(tokens: Tokens, at: int) -> bool:
    """Whether it stands where a noun does: behind an article, a preposition or another noun."""
    before = tokens[at - 1].text if at else ""
    if before in _BEFORE_NOUN and before != "and":
        return not tokens[at].text.endswith("ly") and not (before == "to" and _is_verb(tokens, at))
    if at and _counts(tokens[at - 1]):
        return True
    is_form = tokens[at].text.endswith(("ed", "ing", "ly")) or tokens[at].text in SAFE
    return (before in BODY_WORDS or before in OTHER_NOUNS) and not is_form


def _is_verb(tokens: Tokens, at: int) -> bool:
    """Whether "to" and this word are an infinitive: an article or a verb's object follows."""
    following = tokens[at + 1].text if at + 1 < len(tokens) else ""
    return tokens[at].text in SAFE and following in _BEGINS_NOUN


def _governs(tokens: Tokens, at: int) -> bool:
    """Whether an "-ing" form has something new as its object ("banning a van")."""
    following = tokens[at + 1].text if at + 1 < len(tokens) else ""
    return tokens[at].text.endswith("ing") and following in {"a", "an", "any"}


def _counts(token: Token) -> bool:
    return token.number is not None or token.text in NUMBER_WORDS


def _measures(tokens: Tokens, at: int) -> bool:
    """Whether a number or a unit stands at an index."""
    if not 0 <= at < len(tokens):
        return False
    return _counts(tokens[at]) or tokens[at].text in METRES
