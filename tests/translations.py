"""The texts of the product and their German: `python -m tests.translations` writes both files.

What is marked in templates and in Python is collected, new texts get an empty translation, texts
that are gone are dropped, and the compiled file is written anew. Nothing but Python is needed.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import polib
from django.utils.translation.template import templatize

from tests.house.source import ROOT

PO = ROOT / "arena" / "locale" / "de" / "LC_MESSAGES" / "django.po"
MO = PO.with_suffix(".mo")
MARKERS: dict[str, tuple[int | None, int, int | None]] = {
    **dict.fromkeys(
        ("_", "gettext", "gettext_lazy", "gettext_noop", "sentence", "word"), (None, 0, None)
    ),
    **dict.fromkeys(("ngettext", "ngettext_lazy"), (None, 0, 1)),
    **dict.fromkeys(("pgettext", "pgettext_lazy"), (0, 1, None)),
    **dict.fromkeys(("npgettext", "npgettext_lazy"), (0, 1, 2)),
}
"""Which arguments of a call are the context, the text and the plural."""

HEADER = {
    "Project-Id-Version": "Scenario Arena",
    "Language": "de",
    "MIME-Version": "1.0",
    "Content-Type": "text/plain; charset=UTF-8",
    "Content-Transfer-Encoding": "8bit",
    "Plural-Forms": "nplurals=2; plural=(n != 1);",
}

Text = tuple[str | None, str, str | None]
"""The context, the text and its plural; None where there is none."""


def marked() -> dict[Text, list[str]]:
    """Every marked text of the product, with the files that have it."""
    found: dict[Text, list[str]] = {}
    for path in sorted((ROOT / "templates").rglob("*.*")):
        if path.suffix in {".html", ".svg", ".txt"}:
            source = templatize(path.read_text(), origin=str(path))
            _note(found, path, _in_templatized(source))
    for package in ("arena", "augment"):
        for path in sorted((ROOT / package).rglob("*.py")):
            if "migrations" not in path.parts:
                _note(found, path, _in_python(path.read_text()))
    return found


def update() -> polib.POFile:
    """Bring the catalogue up to date and compile it; gives what it holds now."""
    old = {text_of(entry): entry for entry in polib.pofile(str(PO))}
    new = polib.POFile(wrapwidth=99)
    new.metadata = HEADER
    for known, files in sorted(marked().items(), key=lambda item: (item[1], str(item[0]))):
        context, text, plural = known
        kept = old.get(known)
        places = [(name, "") for name in files]
        entry = polib.POEntry(msgid=text, msgctxt=context, occurrences=places)
        if "%(" in text:
            entry.flags = ["python-format"]
        if plural is None:
            entry.msgstr = kept.msgstr if kept else ""
        else:
            entry.msgid_plural = plural
            entry.msgstr_plural = kept.msgstr_plural if kept else {0: "", 1: ""}
        new.append(entry)
    new.save(str(PO))
    new.save_as_mofile(str(MO))
    return new


def _note(found: dict[Text, list[str]], path: Path, texts: Iterator[Text]) -> None:
    name = str(path.relative_to(ROOT))
    for text in texts:
        files = found.setdefault(text, [])
        if name not in files:
            files.append(name)


def _in_templatized(source: str) -> Iterator[Text]:
    """The calls that Django's own `templatize` leaves between X-ed out words."""
    string = r"""u?('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")"""
    call = re.compile(
        rf"\b(n?p?gettext|_)\(\s*{string}(?:\s*,\s*{string})?(?:\s*,\s*{string})?", re.S
    )
    for match in call.finditer(source):
        found = [None if text is None else ast.literal_eval(text) for text in match.groups()[1:]]
        yield _chosen(match.group(1), found)


def _in_python(source: str) -> Iterator[Text]:
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
            continue
        found = [_constant(argument) for argument in node.args]
        if node.func.id in MARKERS and found and found[0] is not None:
            yield _chosen(node.func.id, found)


def _chosen(marker: str, arguments: list[str | None]) -> Text:
    context, text, plural = MARKERS[marker]
    given = arguments[text]
    assert given is not None, f"{marker}{arguments} marks no text"
    return (
        None if context is None else arguments[context],
        given,
        None if plural is None else arguments[plural],
    )


def text_of(entry: polib.POEntry | polib.MOEntry) -> Text:
    return entry.msgctxt, entry.msgid, entry.msgid_plural or None


def _constant(node: ast.expr) -> str | None:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


if __name__ == "__main__":
    catalogue = update()
    for entry in catalogue.untranslated_entries():
        print(entry.msgctxt or "", repr(entry.msgid), entry.msgid_plural or "")
    print(f"{len(catalogue)} texts, {catalogue.percent_translated()} % translated.")
