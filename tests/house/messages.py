"""Messages that voters see, as they are marked in templates and in Python."""

import ast
import re
from collections.abc import Iterator

from django.utils.translation.template import templatize

from tests.house.source import ROOT

VOTER_MODULES = (
    *("arena/api/access.py", "arena/api/errors.py", "arena/models/votes.py"),
    *("arena/templatetags/shell.py", "arena/people/pages.py", "arena/voting/screen.py"),
    *("arena/studies/pages/experts.py", "arena/studies/services/taking_part.py"),
    "arena/voting/pages.py",
)
"""Modules whose messages stand on pages that voters are shown."""

POSITIONS: dict[str, tuple[int | None, int, int | None]] = {
    **dict.fromkeys(("_", "gettext", "gettext_lazy", "gettext_noop"), (None, 0, None)),
    **dict.fromkeys(("ngettext", "ngettext_lazy"), (None, 0, 1)),
    **dict.fromkeys(("pgettext", "pgettext_lazy"), (0, 1, None)),
    **dict.fromkeys(("npgettext", "npgettext_lazy"), (0, 1, 2)),
}
"""Which arguments of a call are the context, the message and its plural."""

Message = tuple[str | None, str, str | None]
"""Context, message and plural; None where there is none."""


def marked_messages() -> set[Message]:
    """Return every message of the templates and of voters' modules."""
    found: set[Message] = set()
    for path in (ROOT / "templates").rglob("*.*"):
        if path.suffix in {".html", ".svg"}:
            found.update(_in_template(templatize(path.read_text(), origin=str(path))))
    for name in VOTER_MODULES:
        found.update(_in_python((ROOT / name).read_text()))
    return found


def _in_template(source: str) -> Iterator[Message]:
    """Return the calls that Django's `templatize` leaves between X-ed out words."""
    string = r"""u?('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")"""
    call = re.compile(
        rf"\b(n?p?gettext|_)\(\s*{string}(?:\s*,\s*{string})?(?:\s*,\s*{string})?", re.S
    )
    for match in call.finditer(source):
        marker, *texts = match.groups()
        yield _message(marker, [text and ast.literal_eval(text) for text in texts])


def _in_python(source: str) -> Iterator[Message]:
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
            continue
        texts = [
            part.value if isinstance(part, ast.Constant) and isinstance(part.value, str) else None
            for part in node.args
        ]
        if node.func.id in POSITIONS and any(texts):
            yield _message(node.func.id, texts)


def _message(marker: str, texts: list[str | None]) -> Message:
    context, message, plural = (
        None if position is None else texts[position] for position in POSITIONS[marker]
    )
    assert message is not None, f"{marker}{texts} marks no message"
    return context, message, plural
