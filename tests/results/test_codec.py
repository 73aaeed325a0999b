"""Results of a snapshot: of every version read, written as they were, never half understood."""

import copy
import hashlib
import json
from typing import Any

import pytest
from django.core import serializers
from django.urls import reverse

from arena.exports.formats import make_csv
from arena.models import Snapshot
from arena.rating.snapshot_document import (
    VERSION,
    BoardRemarks,
    Results,
    read_results,
    read_text,
    results_document,
)
from arena.results.exports import writers
from arena.results.pages.tabs import TABS
from augment.errors import InvalidDocument
from tests.results.old import OLD, stored
from tests.web.cast import people, signed_in


def _still_kept() -> dict[str, Any]:
    """The old document as it is written now: sentences as text, without what was dropped."""
    document: dict[str, Any] = _with_plain_text(OLD["snapshot"]["results"])
    del document["claims"], document["own_votes"], document["board"]["check"]
    for name in ("removal", "elo_order", "fit"):
        del document["trust"][name]
    for line in document["trust"]["raters"]:
        del line["bet"]
    return document


def _with_plain_text(value: Any) -> Any:
    if isinstance(value, list):
        return [_with_plain_text(one) for one in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"text", "values"}:
        return value["text"] % value["values"]
    return {key: _with_plain_text(one) for key, one in value.items()}


def test_an_old_document_is_written_as_it_was_read_but_for_what_was_dropped() -> None:
    found = read_results(OLD["snapshot"]["results"])
    assert results_document(found) == _still_kept()
    assert (found.version, found.board.order, found.types[0].lines[0].note) == (1, (), None)
    assert found.board.warnings[0] == (
        "Only 4 experts: intervals that rest on fewer than 20 of them are rough."
    )


def test_what_a_version_brought_is_a_key_of_it_also_when_it_is_empty() -> None:
    document = results_document(Results(version=VERSION))
    assert document["board"]["order"] == []
    assert results_document(Results(version=1))["board"].keys() == document["board"].keys() - {
        "order",
        "p_values",
        "seems_above",
    }
    assert (read_results(document), read_results({})) == (Results(version=VERSION), Results())
    assert results_document(Results()) == {}
    apart = Results(version=VERSION, board=BoardRemarks(settled={}))
    assert "settled" not in document["board"], "as ratings of this version were stored before it"
    assert read_results(results_document(apart)) == apart


def test_names_in_an_older_sentence_are_joined_and_groups_told_apart() -> None:
    values = {"groups": [["a", "b"], ["c"]], "names": ["d", "e"], "number": 2}
    stored = {"text": "%(number)s of %(groups)s and %(names)s", "values": values}
    assert read_text(stored) == "2 of a, b; c and d, e"


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("version",), VERSION + 1, f"version: a version from 0 to {VERSION}, not {VERSION + 1}"),
        (("version",), "new", "not 'new'"),
        (("pairs", 0, "wins"), "many", "pairs.0.wins: "),
        (("board", "warnings", 0), 7, "board.warnings.0: .*a sentence or plain text"),
    ],
)
def test_what_can_not_be_read_is_refused_with_its_place(
    path: tuple[str | int, ...], value: object, said: str
) -> None:
    document: Any = copy.deepcopy(OLD["snapshot"]["results"])
    place = document
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    with pytest.raises(InvalidDocument, match=said):
        read_results(document)


@pytest.mark.django_db
def test_an_old_rating_opens_on_every_tab_and_exports_the_same_bytes() -> None:
    snapshot = stored(OLD["snapshot"]["results"])
    staff = signed_in(people()["researcher"])
    for tab in TABS:
        page = staff.get(reverse("results-tab", args=[snapshot.study.code, tab]))
        assert page.status_code == 200, tab
    results = snapshot.results
    raters = make_csv(writers.RATERS, results.trust.raters)
    files = {
        "pairs.csv": writers._pairs_csv(results),
        "types.csv": writers._types_csv(results),
        "raters.csv": _without_last(raters, b"checks_skipped,aids"),
    }
    found = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    assert found == {name: OLD["files"][name] for name in files}


@pytest.mark.django_db
def test_a_rating_that_kept_its_standings_alone_opens_on_every_tab() -> None:
    snapshot = stored({})
    staff = signed_in(people()["researcher"])
    for tab in TABS:
        page = staff.get(reverse("results-tab", args=[snapshot.study.code, tab]))
        said = "keeps the table alone" in page.content.decode()
        assert said is (tab != "log"), tab  # the log is no part of a rating


@pytest.mark.django_db
def test_a_dump_has_the_document_and_loads_again() -> None:
    kept = _still_kept()
    text = serializers.serialize("json", [stored(kept)])
    assert json.loads(text)[0]["fields"]["results"] == kept
    next(iter(serializers.deserialize("json", text))).save()
    assert Snapshot.objects.get().results == read_results(kept)


def _without_last(table: bytes, columns: bytes) -> bytes:
    """A table as it was before columns were added at its end."""
    head, *rows = table.splitlines(keepends=True)
    assert head.rstrip().endswith(b"," + columns)
    more = columns.count(b",") + 1
    end = head[len(head.rstrip()) :]
    return b"".join(line.rstrip().rsplit(b",", more)[0] + end for line in (head, *rows))
