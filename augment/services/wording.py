"""Sentences in the language of whoever reads them; only doors ask for this, no service does."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from django.utils.translation import get_language, gettext_noop
from django.utils.translation import gettext as _

from augment.sentences import Sentence, fill_sentence, sentence_of

_WORDS = ("types", "reasons")
"""Values of ratings' sentences that are words of ours, not names."""

MARKED = (
    *(gettext_noop("contestant"), gettext_noop("scenario"), gettext_noop("expert")),
    *(gettext_noop("expert of this study"), gettext_noop("scenario type"), gettext_noop("method")),
    *(gettext_noop("resampling unit"), gettext_noop("variant"), gettext_noop("study")),
    *(gettext_noop("job"), gettext_noop("labelling"), gettext_noop("name")),
    *(gettext_noop("open"), gettext_noop("closed")),
    *(gettext_noop("running"), gettext_noop("finished"), gettext_noop("cancelled")),
    *(gettext_noop("stopped at cap"), gettext_noop("paused"), gettext_noop("endpoint")),
)
"""What errors call things and states: marked here, as it stands there in values."""


def translate(sentence: str | Exception) -> str:
    """A sentence, a note or what an error says; what is not in the catalogue stays English."""
    text = sentence_of(sentence) if isinstance(sentence, Exception) else sentence
    if isinstance(text, Sentence):
        values = {
            name: _said_value(value, is_ours=name in _WORDS) for name, value in text.values.items()
        }
        return fill_sentence(_(text.text), values)
    return _(text) if text else ""


def translate_all(texts: tuple[str, ...]) -> Mapping[str, str]:
    """Marked texts and what they are in the reader's language.

    For what is said many times in one answer: the catalogue takes long over a single text.
    """
    return _in_words(texts, get_language())


@cache
def _in_words(texts: tuple[str, ...], language: str | None) -> Mapping[str, str]:
    return {text: _(text) for text in texts}


def _said_value(value: Any, *, is_ours: bool) -> Any:
    """Names stay as they are; sentences among them, and words of ours, are said."""
    if isinstance(value, tuple):
        return tuple(_said_value(part, is_ours=is_ours) for part in value)
    return translate(value) if isinstance(value, Sentence) or is_ours else value
