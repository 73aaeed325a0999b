"""JSON, YAML and XML files from outside, read once and without surprises.

JSON and YAML become dicts, lists, texts, numbers, booleans and None. YAML can name a part once
and repeat it (a file of a kilobyte becomes gigabytes), nest without an end, and make dates and
binaries of what looks like text: all of it is refused, with its place, before anything is built.
XML with a document type, in which all that is dangerous begins, is refused too.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import yaml

from augment.errors import InvalidDocument

MAX_BYTES = 64 * 1024 * 1024
MOST_PARTS = 600_000
"""Objects and lists: an empty one takes two bytes here and sixty in memory."""
MOST_VALUES = 2_000_000
MAX_CHARACTERS: Final = 4 * 1024 * 1024
DEEPEST: Final = 20
MOST_YAML_VALUES: Final = 300_000


def _read_bytes(file: Path, what: str, most: int) -> bytes:
    try:
        size = file.stat().st_size
        if size > most:
            problem = f"{size} bytes; at most {most} are read"
            raise InvalidDocument(what, [(file.name, problem)])
        return file.read_bytes()
    except OSError as fault:
        raise InvalidDocument(what, [(file.name, fault.strerror or "can't be read")]) from None


def read_text_file(file: Path, *, what: str) -> str:
    """Return the text of a file in UTF-8 of at most `MAX_CHARACTERS` bytes.

    Raises:
        InvalidDocument: No such file, too large, or not UTF-8.
    """
    try:
        return _read_bytes(file, what, MAX_CHARACTERS).decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise InvalidDocument(what, [(file.name, f"is not UTF-8: {fault.reason}")]) from None


# JSON


def read_json(file: Path, *, what: str) -> object:
    """Return the content of a JSON file.

    Args:
        file: A file in UTF-8 of at most `MAX_BYTES`.
        what: The kind of document, for the sentence.

    Raises:
        InvalidDocument: No such file, too large, no JSON, a name twice in one object, or a text
            that no database takes.
    """
    return parse_json(_read_bytes(file, what, MAX_BYTES), what=what, place=file.name)


def parse_json(block: bytes, *, what: str, place: str) -> object:
    """Return the content of JSON in UTF-8; a fault names the place. Raises as `read_json`."""
    try:
        # Brackets and commas within texts count too.
        if block.count(b"{") + block.count(b"[") > MOST_PARTS:
            raise ValueError(f"more than {MOST_PARTS} objects and lists")
        if block.count(b",") > MOST_VALUES:
            raise ValueError(f"more than {MOST_VALUES} values")
        value = json.loads(block.decode("utf-8"), object_pairs_hook=_build_object)
        _check_texts(value)
        return value
    except RecursionError:
        raise InvalidDocument(what, [(place, "is nested too deeply")]) from None
    except ValueError as fault:  # not JSON, not UTF-8, or a number of thousands of digits
        raise InvalidDocument(what, [(place, f"is not JSON: {fault}")]) from None


def _build_object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    built = dict(pairs)
    if len(built) < len(pairs):
        names = Counter(name for name, _ in pairs)
        raise ValueError(f"named twice in one object: {names.most_common(1)[0][0][:40]!a}")
    return built


def _check_texts(value: object) -> None:
    """Raise ValueError for a text with NUL or half a character, which JSON can escape."""
    if isinstance(value, str):
        if "\0" in value:
            raise ValueError(f"NUL in {value[:40]!r}")
        value.encode()
    elif isinstance(value, dict):
        _check_texts([*value, *value.values()])
    elif isinstance(value, list):
        for item in value:
            _check_texts(item)


# YAML


def read_yaml_file(file: Path, *, what: str) -> object:
    """Return the content of a YAML file.

    Args:
        file: In UTF-8, of at most `MAX_CHARACTERS` bytes.
        what: The kind of document, for the sentence.

    Raises:
        InvalidDocument: No such file, too large, no text, or not plain YAML.
    """
    return read_yaml(read_text_file(file, what=what), what=what)


def read_yaml(text: str, *, what: str) -> object:
    """Return the content of a YAML text; keys are texts, as they stand there.

    Raises:
        InvalidDocument: With line and column where YAML knows them.
    """
    if len(text) > MAX_CHARACTERS:
        problem = f"{len(text)} characters; at most {MAX_CHARACTERS} are read"
        raise InvalidDocument(what, [("", problem)])
    try:
        _check_events(text)
        return yaml.load(text, Loader=_PlainLoader)
    except yaml.MarkedYAMLError as fault:
        mark, problem = fault.problem_mark, f"{fault.problem or fault.context}"
    except (yaml.YAMLError, ValueError) as fault:  # a character or number that can't be
        mark, problem = None, " ".join(str(fault).split())
    place = "" if mark is None else f"line {mark.line + 1}, column {mark.column + 1}"
    raise InvalidDocument(what, [(place, f"is no plain YAML: {problem}")])


_PLAIN_TAGS = frozenset(f"tag:yaml.org,2002:{kind}" for kind in ("bool", "int", "float", "null"))
_BASE: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml's where it is there


class _PlainLoader(_BASE):  # type: ignore[misc]
    """Builds no dates and no merged keys, and refuses a key that stands twice."""

    yaml_implicit_resolvers = {
        first: [(tag, pattern) for tag, pattern in resolvers if tag in _PLAIN_TAGS]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[str, Any]:
        built: dict[str, Any] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or key.value in built:
                raise _not_plain(key, "a key is a text, and stands once")
            built[key.value] = self.construct_object(value, deep=deep)
        return built


def _check_events(text: str) -> None:
    """Raise for what is not plain, while nothing is kept of it."""
    depth = values = 0
    for event in yaml.parse(text, Loader=_BASE):
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if not isinstance(event, yaml.NodeEvent):
            continue
        values += 1
        depth += isinstance(event, yaml.CollectionStartEvent)
        if event.anchor is not None or getattr(event, "tag", None) is not None:
            raise _not_plain(event, "anchors, aliases and tags (&, *, !) are not read")
        if depth > DEEPEST or values > MOST_YAML_VALUES:
            most = f"{DEEPEST} levels and {MOST_YAML_VALUES} values"
            raise _not_plain(event, f"has more than {most}")


def _not_plain(where: Any, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=where.start_mark)


# XML


def read_xml(path: Path, *, what: str) -> ET.Element:
    """Return the root of an XML file; names of the root's namespace are without it.

    Raises:
        InvalidDocument: The file is not there, is no XML, or has a document type.
    """
    try:
        root: ET.Element = ET.XML(path.read_bytes(), parser=ET.XMLParser(target=_NoDoctype()))
        space = root.tag[: root.tag.rfind("}") + 1]
        for element in root.iter() if space else ():
            element.tag = element.tag.removeprefix(space)
        return root
    except OSError as fault:
        problem = fault.strerror or str(fault)
    except (ET.ParseError, LookupError, ValueError) as fault:
        problem = f"is no XML that is read: {fault}"
    raise InvalidDocument(what, [(path.name, problem)])


class _NoDoctype(ET.TreeBuilder):
    def doctype(self, *_: object) -> None:
        """Refuse a document type, in which all that is dangerous begins."""
        raise ValueError("declares a document type")
