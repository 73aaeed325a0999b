"""Messages of voters: marked in their modules alone, and each in German."""

import ast
import re

import polib
import pytest

from arena.management.commands.prepare import GERMAN
from tests.house.messages import VOTER_MODULES, marked_messages
from tests.house.source import walked

PLACES = re.compile(r"%\(\w+\)s|\{\w*\}")


def test_the_catalogue_holds_the_messages_of_voters_and_no_others() -> None:
    entries = polib.pofile(str(GERMAN))
    held = {(one.msgctxt, one.msgid, one.msgid_plural or None) for one in entries}
    assert held ^ marked_messages() == set()
    assert len(held) == len(entries)


def test_every_message_has_a_german_text_with_the_same_places() -> None:
    for entry in polib.pofile(str(GERMAN)):
        wanted = set(PLACES.findall(entry.msgid_plural or entry.msgid))
        for text in entry.msgstr_plural.values() or [entry.msgstr]:
            assert text, entry.msgid
            assert set(PLACES.findall(text)) <= wanted, entry.msgid


CHOOSING = {"arena.site.language"}
"""It chooses the language of an answer and marks no text."""


@pytest.mark.slow
def test_only_modules_of_the_catalogue_translate() -> None:
    known = CHOOSING | {name.removesuffix(".py").replace("/", ".") for name in VOTER_MODULES}
    found = [
        f"{name}:{node.lineno}"
        for name, nodes in walked()
        if name not in known
        for node in nodes
        if isinstance(node, ast.ImportFrom)
        and (
            node.module == "django.utils.translation"
            or (
                node.module == "django.utils" and "translation" in {one.name for one in node.names}
            )
        )
    ]
    assert found == []
