"""XML from outside as a plain tree: no document type, no entities.

What makes XML dangerous begins in a document type declaration, which no format here needs: a file
that has one is refused where it begins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from augment.errors import InvalidDocument

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
