"""What the parts of the CommonRoad writer share: elements, numbers, ids."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as ET

from augment.escaping import escape_controls

DECIMALS = 9


class Ids:
    """Whole numbers from 1 on, one for each name."""

    def __init__(self) -> None:
        self.by_name: dict[str, int] = {}
        self._last = 0

    def of(self, name: str) -> int:
        """The number of that name; a new one when it is first asked for."""
        if name not in self.by_name:
            self.by_name[name] = self.fresh()
        return self.by_name[name]

    def fresh(self) -> int:
        """A number for something that has no name of ours."""
        self._last += 1
        return self._last


def add(parent: ET.Element, name: str, text: str | None = None, **attributes: Any) -> ET.Element:
    """A new child at the end."""
    made = ET.SubElement(parent, name, attributes)
    made.text = text
    return made


def number(value: float) -> str:
    """A decimal: the schema knows no exponents."""
    text = f"{value:.{DECIMALS}f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def text_of(root: ET.Element, *, comment: str) -> bytes:
    """The whole file."""
    safe = escape_controls(comment).replace("--", "- -")
    body = ET.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n<!-- {safe} -->\n{body}\n".encode()
