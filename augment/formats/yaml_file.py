"""YAML from outside, read without surprises: plain mappings, lists, texts, numbers, nothing else.

YAML can name a part once and repeat it (a file of a kilobyte becomes gigabytes), nest without an
end, name a key twice, and make dates and binaries of what looks like text. None of that belongs
in a file of numbers, so all of it is refused, with its place, before anything is built.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import yaml

from augment.errors import InvalidDocument

MAX_CHARACTERS: Final = 4 * 1024 * 1024
DEEPEST: Final = 20
MOST_VALUES: Final = 300_000
LONGEST_TEXT: Final = 1_000
LONGEST_NUMBER: Final = 18
"""Of a key: larger numbers can be chosen so that all have one hash."""

_PLAIN_TAGS = frozenset(f"tag:yaml.org,2002:{kind}" for kind in ("bool", "int", "float", "null"))
_BASE: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml's where it is there


def read_yaml_file(file: Path, *, what: str) -> object:
    """What the YAML file holds, in dicts, lists, texts, numbers, booleans and None.

    Args:
        file: In UTF-8, of at most `MAX_CHARACTERS` bytes.
        what: The kind of document, for the sentence.

    Raises:
        InvalidDocument: No such file, too large, no text, or not plain YAML.
    """
    try:
        size = file.stat().st_size
        if size > MAX_CHARACTERS:
            text = f"{size} bytes; at most {MAX_CHARACTERS} are read"
            raise InvalidDocument(what, [(file.name, text)])
        return read_yaml(file.read_text(encoding="utf-8"), what=what)
    except OSError as fault:
        raise InvalidDocument(what, [(file.name, fault.strerror or "can't be read")]) from None
    except UnicodeDecodeError as fault:
        raise InvalidDocument(what, [(file.name, f"is not UTF-8: {fault.reason}")]) from None


def read_yaml(text: str, *, what: str) -> object:
    """The same of a text.

    Raises:
        InvalidDocument: With line and column where YAML knows them.
    """
    if len(text) > MAX_CHARACTERS:
        problem = f"{len(text)} characters; at most {MAX_CHARACTERS} are read"
        raise InvalidDocument(what, [("", problem)])
    try:
        _check_events(text)
        return yaml.load(text, Loader=_PlainLoader)
    except _NotPlain as fault:
        raise InvalidDocument(what, [(_place(fault.mark), fault.problem)]) from None
    except yaml.MarkedYAMLError as fault:
        problem = f"is no YAML: {fault.problem or fault.context}"
        raise InvalidDocument(what, [(_place(fault.problem_mark), problem)]) from None
    except yaml.YAMLError as fault:  # a character that no YAML may hold
        raise InvalidDocument(
            what, [("", f"is no YAML: {' '.join(str(fault).split())}")]
        ) from None
    except ValueError as fault:  # a number that Python can't make
        raise InvalidDocument(what, [("", f"has a value that can't be read: {fault}")]) from None


# Private


class _NotPlain(Exception):
    """Valid YAML that is not read here."""

    def __init__(self, mark: Any, problem: str) -> None:
        self.mark = mark
        self.problem = problem
        super().__init__(problem)


class _PlainLoader(_BASE):  # type: ignore[misc]
    """Builds dates and merged keys from nothing, and refuses a key that stands twice."""

    yaml_implicit_resolvers = {
        first: [(tag, pattern) for tag, pattern in resolvers if tag in _PLAIN_TAGS]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        written: set[str] = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _NotPlain(key.start_mark, "a key is a text, not a list or a mapping")
            if key.tag.endswith(":int") and len(key.value) > LONGEST_NUMBER:
                text = f"a key is a number of more than {LONGEST_NUMBER} digits"
                raise _NotPlain(key.start_mark, text)
            if key.value in written:
                raise _NotPlain(key.start_mark, f"the key {_shown(key.value)} stands twice")
            written.add(key.value)
        made: dict[Any, Any] = super().construct_mapping(node, deep=deep)
        if len(made) < len(written):  # 1 and 0x1, or 1 and true
            raise _NotPlain(node.start_mark, "two keys mean the same number")
        return made


def _check_events(text: str) -> None:
    """Raise for what is not plain, while nothing is kept of it."""
    depth = values = 0
    for event in yaml.parse(text, Loader=_BASE):
        if isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if not isinstance(event, yaml.NodeEvent):
            continue
        values += 1
        depth += isinstance(event, yaml.CollectionStartEvent)
        problem = _problem(event, depth, values)
        if problem:
            raise _NotPlain(event.start_mark, problem)


def _problem(event: Any, depth: int, values: int) -> str:
    """What is not plain about a value, empty where nothing is."""
    if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
        return "anchors and aliases (& and *) are not read here"
    if event.tag is not None:
        return "tags (!) are not read here"
    if depth > DEEPEST:
        return f"is nested more than {DEEPEST} levels deep"
    if values > MOST_VALUES:
        return f"has more than {MOST_VALUES} values"
    if isinstance(event, yaml.ScalarEvent) and len(event.value) > LONGEST_TEXT:
        return f"a text of {len(event.value)} characters; at most {LONGEST_TEXT} are read"
    return ""


def _place(mark: Any) -> str:
    return "" if mark is None else f"line {mark.line + 1}, column {mark.column + 1}"


def _shown(text: str) -> str:
    return ascii(text if len(text) <= 40 else text[:37] + "...")
