"""Values as models write them where JSON was asked for: other quotes, Python's words and calls.

Everything is read by this grammar and nothing is evaluated. It only lets through what can be
read in one way: no arithmetic, no units, no names of variables.
"""

from __future__ import annotations

import json
import re

LONGEST_VALUE = 4_000
"""Characters that one value may run over."""
_DEEPEST = 12

_SPACE = re.compile(r"\s*")
_NUMBER = re.compile(r"[-+]?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?(?![\w.])")
_STRING = re.compile(r""""[^"\\\n]*(?:\\.[^"\\\n]*)*"|'[^'\\\n]*(?:\\.[^'\\\n]*)*'""")
_WORD = re.compile(r"[A-Za-z_]\w*")
_ID = re.compile(r"(?:[A-Z][a-z]+[0-9]+[a-z]?|lane)(?!\w)")
_CONSTANTS = {"true": True, "True": True, "false": False, "False": False}
_NOTHING = {"null", "None"}


class Unreadable(Exception):
    """The text is none of these values.

    Attributes:
        at: Where it breaks.
    """

    def __init__(self, at: int, problem: str) -> None:
        self.at = at
        super().__init__(problem)


def value_at(text: str, start: int) -> tuple[object, int]:
    """The value that begins there, and where it ends.

    Raises:
        Unreadable: There is none.
    """
    reader = _Reader(text, start)
    return reader.value(0), reader.at


def arguments_at(text: str, start: int) -> tuple[list[object], dict[str, object], int]:
    """What stands between the brackets of a Python call, by place and by name, and the end.

    Ids may lack their quotes where the argument is named.

    Args:
        text: Where the call stands.
        start: Behind the opening bracket.

    Raises:
        Unreadable: These are not values, or a name stands twice.
    """
    reader = _Reader(text, start)
    placed: list[object] = []
    named: dict[str, object] = {}
    while not reader.takes(")"):
        name = reader.name_before("=")
        if name is None:
            if named:
                raise reader.broken("a value without a name stands behind one with a name")
            placed.append(reader.value(0))
        elif name in named:
            raise reader.broken(f"{name} stands twice")
        else:
            named[name] = reader.value(0, bare=True)
        reader.ends_or_goes_on(")")
    return placed, named, reader.at


class _Reader:
    def __init__(self, text: str, start: int) -> None:
        self.text = text
        self.at = start
        self._end = min(len(text), start + LONGEST_VALUE)

    def value(self, depth: int, *, bare: bool = False) -> object:
        """The value from here on."""
        if depth > _DEEPEST:
            raise self.broken("is nested too deeply")
        if self.takes("{"):
            return self._mapping(depth)
        if self.takes("["):
            return self._list(depth)
        string = self._match(_STRING)
        if string is not None:
            return self._unquoted(string)
        number = self._match(_NUMBER)
        if number is not None:
            return float(number) if re.search(r"[.eE]", number) else int(number)
        return self._word(bare)

    def takes(self, mark: str) -> bool:
        """Whether that mark comes next; if so it is behind us now."""
        self._skip()
        if self.text.startswith(mark, self.at, self._end):
            self.at += len(mark)
            return True
        return False

    def name_before(self, mark: str) -> str | None:
        """The word that stands before that mark, both behind us now; None without one."""
        self._skip()
        before = self.at
        name = self._match(_WORD)
        if name is not None and self.takes(mark):
            return name
        self.at = before
        return None

    def ends_or_goes_on(self, closing: str) -> None:
        """A comma behind us, or the closing mark before us."""
        if self.takes(","):
            return
        self._skip()
        if not self.text.startswith(closing, self.at, self._end):
            raise self.broken(f"expected a comma or {closing}")

    def broken(self, problem: str) -> Unreadable:
        """What is wrong here."""
        return Unreadable(self.at, problem)

    def _mapping(self, depth: int) -> dict[str, object]:
        made: dict[str, object] = {}
        while not self.takes("}"):
            string = self._match(_STRING)
            if string is None:
                raise self.broken("expected a key in quotes")
            key = self._unquoted(string)
            if key in made:
                raise self.broken(f"the key {key[:40]!a} stands twice")
            if not self.takes(":"):
                raise self.broken("expected a colon")
            made[key] = self.value(depth + 1)
            self.ends_or_goes_on("}")
        return made

    def _list(self, depth: int) -> list[object]:
        made: list[object] = []
        while not self.takes("]"):
            made.append(self.value(depth + 1))
            self.ends_or_goes_on("]")
        return made

    def _word(self, bare: bool) -> object:
        found = self._match(_ID) if bare else None
        if found is not None:
            return found
        before = self.at
        word = self._match(_WORD)
        if word in _NOTHING:
            return None
        if word in _CONSTANTS:
            return _CONSTANTS[word]
        self.at = before
        raise self.broken(f"{word[:40]!a} is no value" if word else "expected a value")

    def _unquoted(self, string: str) -> str:
        body = string[1:-1]
        if string[0] == "'":
            body = body.replace("\\'", "'").replace('"', '\\"').replace('\\\\"', '\\"')
        try:
            made: str = json.loads(f'"{body}"')
        except ValueError:
            raise self.broken("a text with an escape that JSON does not know") from None
        return made

    def _match(self, pattern: re.Pattern[str]) -> str | None:
        self._skip()
        match = pattern.match(self.text, self.at, self._end)
        if match is None:
            return None
        self.at = match.end()
        return match.group()

    def _skip(self) -> None:
        space = _SPACE.match(self.text, self.at, self._end)
        self.at = self.at if space is None else space.end()
