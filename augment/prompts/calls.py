"""Calls of a tool that a model wrote into its answer.

The form that was asked for is a line that is exactly one JSON object. It counts wherever it
stands: an answer with such a call is no final answer, since it was written without the result.
Models write other forms as well: within a sentence or a list, over several lines, with other
keys, other quotes, or as Python. These count where the answer holds no block of changes, so that
nobody who tells in a final answer what was called before is taken to call again.

Whatever the text, nothing is raised: a call that can't be read is a call with a problem, which
goes back to the model.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from augment.errors import ReplyUnreadable
from augment.prompts.blocks import (
    LONGEST_ANSWER,
    names_changes,
    strict_json,
    strict_json_at,
    without_thoughts,
)

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


TOOL = "pose_on_lane"
PARAMETERS = ("lane", "start", "distance_m", "lateral_m", "object")
"""In the order in which the prompt names them."""
MOST_LOOKED_AT = 64

_FORM = '{"call": "pose_on_lane", "arguments": {...}}'
_NAMES = ("call", "name", "function", "tool", "tool_name", "function_name")
_ARGUMENTS = ("arguments", "parameters", "args", "kwargs", "input")
_ASIDE = frozenset({"id", "type"})
_OBJECT = rf"""\{{\s*["'](?P<key>{"|".join((*_NAMES, *_ARGUMENTS, TOOL))})["']\s*:"""
_PYTHON = r"(?<![\w.])(?P<name>\w{0,40}?(?:pose_|_pose)\w{0,40})[ \t]{0,3}\("
_OPENING = re.compile(f"{_OBJECT}|{_PYTHON}")
_EXACT = re.compile(r'\{\s*"call"\s*:')
_ALONE_BEHIND = re.compile(r"[ \t`]*(?:\n|\Z)")


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenCall:
    """One call as it was written.

    Attributes:
        name: Of the tool, empty where it can't be read.
        arguments: Read from JSON, None where they can't be.
        problem: What is wrong with the call itself, empty where nothing is.
        mended: Whether it was understood although it is not in the form that was asked for.
    """

    name: str = ""
    arguments: object = None
    problem: str = ""
    mended: bool = False


def calls_in(answer: str, *, is_cut_off: bool = False) -> tuple[WrittenCall, ...]:
    """The calls of an answer in order; thoughts of models that think aloud hold none.

    An answer that speaks of the tool and holds neither a call nor a block of changes is a call
    with a problem.

    Args:
        answer: The raw text of the model.
        is_cut_off: Whether it hit its length limit: the block of changes may be missing, so
            only the form that was asked for counts.
    """
    if len(answer) > LONGEST_ANSWER:
        return ()
    text = without_thoughts(answer)
    is_final = is_cut_off or names_changes(text)
    calls = tuple(_calls(text, exact_alone=is_final))
    if not calls and not is_final and TOOL in text:
        problem = f"{TOOL} is named and not called; a call is one line of the form {_FORM}"
        return (WrittenCall(problem=problem),)
    return calls


def read_arguments(written: str) -> WrittenCall:
    """The arguments of a native call, a JSON text of their own."""
    if len(written) > LONGEST_ANSWER:
        return WrittenCall(problem=f"the arguments are longer than {LONGEST_ANSWER} characters")
    try:
        return WrittenCall(arguments=strict_json(written))
    except ReplyUnreadable as broken:
        return WrittenCall(problem=f"the arguments are not JSON: {broken.problems[0]}")


# Private


def _calls(text: str, *, exact_alone: bool) -> Iterator[WrittenCall]:
    """Each call of the text that counts."""
    end = looked_at = 0
    for opening in _OPENING.finditer(text):
        start = opening.start()
        is_exact = _EXACT.match(text, start) is not None and _begins_line(text, start)
        if start < end or (exact_alone and not is_exact):
            continue
        looked_at += 1
        if looked_at > MOST_LOOKED_AT:
            return
        read = _python if opening["name"] is not None else _object
        call, end = read(text, opening)
        if call is not None:
            yield call


def _begins_line(text: str, start: int) -> bool:
    line = text.rfind("\n", 0, start) + 1
    return not text[line:start].strip(" \t`")


def _object(text: str, opening: re.Match[str]) -> tuple[WrittenCall | None, int]:
    """A call written as an object, None where it is some other object, and where it ends."""
    start = opening.start()
    strict = ""
    try:
        found, end = strict_json_at(text, start)
    except ReplyUnreadable as broken:
        strict = broken.problems[0].replace("the JSON block", "the line")
        try:
            found, end = value_at(text, start)
        except Unreadable:
            problem = f"a call is one line of the form {_FORM}; {strict}"
            return WrittenCall(problem=problem), _end_of_line(text, start)
    call = _call_of(found)
    is_alone = _begins_line(text, start) and _ALONE_BEHIND.match(text, end) is not None
    has_form = isinstance(found, dict) and found.keys() == {"call", "arguments"}
    if call is None or call.problem or (is_alone and has_form and not strict):
        return call, end
    return replace(call, mended=True), end


def _call_of(found: object) -> WrittenCall | None:
    """What an object calls, None where it is something else."""
    if not isinstance(found, dict):
        return None
    inner = found.get("function")
    body: dict[str, object] = inner if isinstance(inner, dict) else found
    if body.keys() == {TOOL}:
        return _with_arguments(TOOL, body[TOOL])
    name_key = next((key for key in _NAMES if key in body), None)
    arguments_key = next((key for key in _ARGUMENTS if key in body), None)
    name = None if name_key is None else body[name_key]
    rest = {key: value for key, value in body.items() if key not in {name_key, arguments_key}}
    if not isinstance(name, str):
        is_call = name_key == "call" or arguments_key is not None
        return WrittenCall(problem=f"a call has the form {_FORM}") if is_call else None
    if arguments_key is not None and rest.keys() <= _ASIDE:
        return _with_arguments(name, body[arguments_key])
    if arguments_key is None and name == TOOL and rest.keys() & set(PARAMETERS):
        return _with_arguments(name, rest)
    if name == TOOL or name_key == "call":
        return WrittenCall(problem=f"a call has the form {_FORM} and no other keys")
    return None


def _with_arguments(name: str, arguments: object) -> WrittenCall:
    if isinstance(arguments, str):
        return replace(read_arguments(arguments), name=name)
    return WrittenCall(name=name, arguments=arguments)


def _python(text: str, opening: re.Match[str]) -> tuple[WrittenCall | None, int]:
    """A call written as Python, None where the tool is only named, and where it ends."""
    start, name = opening.end(), opening["name"]
    try:
        placed, named, end = arguments_at(text, start)
    except Unreadable as broken:
        if not re.match(r"[^)\n]*[=\"'0-9]", text[start : start + 200]):
            return None, start  # a signature
        near = text[broken.at : broken.at + 20].split("\n")[0]
        problem = f"a call is one line of the form {_FORM}; {broken} at {near!a}"
        return WrittenCall(problem=problem), max(broken.at, start)
    if not placed and not named:
        return None, end
    by_place = dict(zip(PARAMETERS, placed, strict=False))
    if len(placed) > len(PARAMETERS) or by_place.keys() & named.keys():
        return WrittenCall(problem=f"a call has the form {_FORM}"), end
    return WrittenCall(name=name, arguments=by_place | named, mended=True), end


def _end_of_line(text: str, start: int) -> int:
    end = text.find("\n", start)
    return len(text) if end < 0 else end
