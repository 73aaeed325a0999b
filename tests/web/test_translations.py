"""The German texts: all there, none doubtful, and compiled."""

from __future__ import annotations

import re

import polib
import pytest

from arena.queries.profiles import Language
from tests.translations import MO, PO, marked, text_of

ON_EXPERT_PAGES = (
    "templates/vote/",
    "templates/label/",
    "templates/home/expert",
    "arena/web/screen",
    "arena/queries/voting_keys",
)
TELLING = re.compile(r"\b(Modell\w*|LLM|generier\w*|KI|GPT)\b")
HELD = re.compile(r"%\(\w+\)s|\{[^{} ]*\}|%%|</?\w+[^>]*>")


def held(text: str) -> list[str]:
    return sorted(HELD.findall(text))


@pytest.fixture(scope="module")
def catalogue() -> list[polib.POEntry]:
    return list(polib.pofile(str(PO)))


def test_every_marked_text_is_in_the_catalogue_and_nothing_else(
    catalogue: list[polib.POEntry],
) -> None:
    """Red after a change of texts: run `python -m tests.translations` and translate."""
    known = {text_of(entry) for entry in catalogue}
    assert [text for text in marked() if text not in known] == []
    assert known - set(marked()) == set()


def test_nothing_is_untranslated_or_fuzzy(catalogue: list[polib.POEntry]) -> None:
    assert [entry.msgid for entry in catalogue if not entry.translated() or entry.fuzzy] == []


def test_the_compiled_file_says_the_same(catalogue: list[polib.POEntry]) -> None:
    compiled = {text_of(e): (e.msgstr, e.msgstr_plural) for e in polib.mofile(str(MO))}
    assert compiled == {text_of(e): (e.msgstr, e.msgstr_plural) for e in catalogue}


def test_what_is_filled_in_stands_in_both_languages(catalogue: list[polib.POEntry]) -> None:
    for entry in catalogue:
        one, many = entry.msgid, entry.msgid_plural or entry.msgid
        said = entry.msgstr_plural if entry.msgid_plural else {0: entry.msgstr}
        assert held(said[0]) in (held(one), held(many)), said
        assert all(held(text) == held(many) for n, text in said.items() if n), said


def test_experts_read_no_telling_word(catalogue: list[polib.POEntry]) -> None:
    shown = [
        entry
        for entry in catalogue
        if any(name.startswith(ON_EXPERT_PAGES) for name, _ in entry.occurrences)
    ]
    assert shown
    said = [text for e in shown for text in (e.msgstr, *e.msgstr_plural.values())]
    assert [text for text in said if TELLING.search(text)] == []


def test_the_pages_have_the_languages_of_the_settings(settings: object) -> None:
    offered = dict(settings.LANGUAGES)  # type: ignore[attr-defined]
    assert offered == {language.value: language.label for language in Language}
