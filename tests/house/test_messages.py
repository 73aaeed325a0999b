"""Every message that voters see has a German text, and the catalogue holds no other."""

import re

import polib

from arena.management.commands.prepare import GERMAN
from tests.house.messages import marked_messages

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
