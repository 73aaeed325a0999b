"""JSON files from outside, read once and without surprises."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.parsers import expat

import yaml

from augment.errors import InvalidDocument

MAX_BYTES = 64 * 1024 * 1024
MOST_PARTS = 600_000
"""Objects and lists: an empty one takes two bytes here and sixty in memory."""
MOST_VALUES = 2_000_000
_MOST_NAMED = 5
_LONGEST_NAMED = 40


def read_json(file: Path, *, what: str) -> object:
    """What the JSON file holds.

    Args:
        file: A file in UTF-8 of at most `MAX_BYTES`.
        what: The kind of document, for the sentence.

    Raises:
        InvalidDocument: No such file, too large, no JSON, a name twice in one object, or a text
            that no database takes.
    """
    try:
        size = file.stat().st_size
        if size > MAX_BYTES:
            text = f"{size} bytes; at most {MAX_BYTES} are read"
            raise InvalidDocument(what, [(file.name, text)])
        block = file.read_bytes()
        _check_counts(block)
        value = json.loads(block.decode("utf-8"), object_pairs_hook=_object)
        _check_texts(value)
        return value
    except OSError as fault:
        raise InvalidDocument(what, [(file.name, fault.strerror or "can't be read")]) from None
    except RecursionError:
        raise InvalidDocument(what, [(file.name, "is nested too deeply")]) from None
    except ValueError as fault:  # not JSON, not UTF-8, or a number of thousands of digits
        raise InvalidDocument(what, [(file.name, f"is not JSON: {fault}")]) from None


def _check_counts(block: bytes) -> None:
    """Raise ValueError for more than is read; brackets and commas within texts count too."""
    if block.count(b"{") + block.count(b"[") > MOST_PARTS:
        raise ValueError(f"more than {MOST_PARTS} objects and lists")
    if block.count(b",") > MOST_VALUES:
        raise ValueError(f"more than {MOST_VALUES} values")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        times = Counter(name for name, _ in pairs)
        doubled = sorted(name for name, count in times.items() if count > 1)
        shown = ", ".join(ascii(name[:_LONGEST_NAMED]) for name in doubled[:_MOST_NAMED])
        more = len(doubled) - _MOST_NAMED
        rest = f" and {more} more" if more > 0 else ""
        raise ValueError(f"named twice in one object: {shown}{rest}")
    return made


def _check_texts(value: object) -> None:
    """Raise ValueError for a text with NUL or half a character, which JSON can escape."""
    if isinstance(value, str):
        if "\0" in value:
            raise ValueError(f"NUL in {value[:40]!r}")
        value.encode()
    elif isinstance(value, dict):
        for name, item in value.items():
            _check_texts(name)
            _check_texts(item)
    elif isinstance(value, list):
        for item in value:
            _check_texts(item)


MAX_CHARACTERS: Final = 4 * 1024 * 1024
DEEPEST: Final = 20
MOST_YAML_VALUES: Final = 300_000
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
    if values > MOST_YAML_VALUES:
        return f"has more than {MOST_YAML_VALUES} values"
    if isinstance(event, yaml.ScalarEvent) and len(event.value) > LONGEST_TEXT:
        return f"a text of {len(event.value)} characters; at most {LONGEST_TEXT} are read"
    return ""


def _place(mark: Any) -> str:
    return "" if mark is None else f"line {mark.line + 1}, column {mark.column + 1}"


def _shown(text: str) -> str:
    return ascii(text if len(text) <= 40 else text[:37] + "...")


_BLOCK = 1 << 16


@dataclass(slots=True)
class Element:
    """An element of the tree.

    Attributes:
        text: What stands in it before its first child.
    """

    name: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def all(self, *names: str) -> Iterator[Element]:
        """The children of these names."""
        return (child for child in self.children if child.name in names)

    def first(self, *names: str) -> Element | None:
        """The first child of these names."""
        return next(self.all(*names), None)


def read_xml(path: Path, *, what: str) -> Element:
    """The root of the file.

    Raises:
        InvalidDocument: The file is not there, is no XML, or has a document type.
    """
    try:
        with path.open("rb") as file:
            building = _Building(what, path.name)
            while block := file.read(_BLOCK):
                building.feed(block)
            return building.finish()
    except OSError as fault:
        raise InvalidDocument(what, [(str(path), fault.strerror or str(fault))]) from None


class _Building:
    def __init__(self, what: str, name: str) -> None:
        self._what, self._name = what, name
        self._open = [Element("", {})]
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartDoctypeDeclHandler = self._doctype
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text

    def feed(self, block: bytes, *, last: bool = False) -> None:
        try:
            self._parser.Parse(block, last)
        except (expat.ExpatError, LookupError, ValueError) as fault:
            raise self._fault(f"is no XML: {fault}") from None

    def finish(self) -> Element:
        self.feed(b"", last=True)
        return self._open[0].children[0]

    def _fault(self, text: str) -> InvalidDocument:
        return InvalidDocument(self._what, [(self._name, text)])

    def _doctype(self, *_: object) -> None:
        raise self._fault("declares a document type, which is not read")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        element = Element(name, attributes)
        self._open[-1].children.append(element)
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _text(self, text: str) -> None:
        element = self._open[-1]
        if not element.children:
            element.text += text
