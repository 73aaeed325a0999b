"""Mutations drawn over all modules by a seed, so that nobody chooses where tests look."""

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from tests.house.source import PRODUCT
from tests.mutants.mutation import ROOT, Mutation

DRAWN = "drawn"
SYMBOLS = {
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="),
    ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
"""What stands between two operands, and what becomes of it."""
FOLDERS = {
    "arena/voting": "tests/votes tests/studies tests/web",
    "arena/results": "tests/results tests/exports tests/web",
    "arena/models": "tests/studies tests/votes tests/exports",
    "arena/scenarios": "tests/web tests/jobs",
    "augment/models": "tests/services tests/jobs",
}
"""Tests of packages whose folders have other names."""
EVERYTHING = ("tests", "-m", "not slow and not browser")
"""What runs where the nearest tests notice nothing."""

Edit = tuple[int, int, str]
"""From and to which byte of a file, and what stands there instead."""


def draw(number: int, seed: int) -> list[Mutation]:
    """Return as many mutations of as many modules, each of one drawn place."""
    rng, drawn = Random(seed), dict[str, Mutation]()
    files = sorted(
        path
        for package in PRODUCT
        for path in (ROOT / package).rglob("*.py")
        if "migrations" not in path.parts
    )
    while len(drawn) < number:
        path = rng.choice(files)
        if edits := list(_list_edits(path.read_bytes())):
            mutation = _mutation(path, rng.choice(edits))
            drawn.setdefault(mutation.name, mutation)
    return list(drawn.values())


def _list_edits(source: bytes) -> Iterator[Edit]:
    starts = [0, *(newline.end() for newline in re.finditer(b"\n", source))]

    def begin(node: ast.expr) -> int:
        return starts[node.lineno - 1] + node.col_offset

    def end(node: ast.expr) -> int:
        return starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)

    for node in _walk(ast.parse(source)):
        match node:
            case ast.UnaryOp(op=ast.Not()):
                yield begin(node), begin(node) + len("not "), ""
            case ast.IfExp(test=test) | ast.If(test=test):
                condition = source[begin(test) : end(test)].decode()
                yield begin(test), end(test), f"not ({condition})"
            case ast.Constant(value=bool() as value):
                yield begin(node), end(node), str(not value)
            case ast.Constant(value=int() | float() as number):
                yield begin(node), end(node), repr(number + 1)
            case _:
                yield from _exchange(node, source, begin, end)


def _exchange(
    node: ast.AST, source: bytes, begin: Callable[[ast.expr], int], end: Callable[[ast.expr], int]
) -> Iterator[Edit]:
    match node:
        case ast.Compare(left=left, ops=[operator], comparators=[right]):
            pass
        case ast.BinOp(left=left, op=operator, right=right):
            pass
        case ast.BoolOp(op=operator, values=[left, right, *_]):
            pass
        case _:
            return
    old, new = SYMBOLS.get(type(operator), ("", ""))
    between = source[end(left) : begin(right)]
    if old and between.count(old.encode()) == 1:
        at = end(left) + between.index(old.encode())
        yield at, at + len(old), new


def _walk(node: ast.AST) -> Iterator[ast.AST]:
    """Yield all nodes but those of decorators, annotations, f-strings and zip's strict."""
    for name, value in ast.iter_fields(node):
        if name in ("decorator_list", "annotation", "returns"):
            continue
        for child in value if isinstance(value, list) else [value]:
            is_strict = isinstance(child, ast.keyword) and child.arg == "strict"
            if (
                isinstance(child, ast.AST)
                and not isinstance(child, ast.JoinedStr)
                and not is_strict
            ):
                yield child
                yield from _walk(child)


def _mutation(path: Path, edit: Edit) -> Mutation:
    """Return it with as many lines around as make the place unique."""
    source = path.read_bytes()
    begin, end, new = edit
    low, high = source.rfind(b"\n", 0, begin) + 1, source.find(b"\n", end)
    while source.count(source[low:high]) > 1:
        low, high = source.rfind(b"\n", 0, low - 1) + 1, source.find(b"\n", high + 1)
    line = source.count(b"\n", 0, begin)
    file = path.relative_to(ROOT).as_posix()
    subject = "/".join(file.split("/")[:2])
    folders = FOLDERS.get(subject, f"tests/{Path(subject).name}").split()
    nearest = tuple(folder for folder in folders if (ROOT / folder).is_dir())
    return Mutation(
        area=DRAWN,
        name=f"{file}:{line + 1}:{begin}",
        file=file,
        old=source[low:high].decode(),
        new=(source[low:begin] + new.encode() + source[end:high]).decode(),
        tests=nearest or EVERYTHING,
    )
