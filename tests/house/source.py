"""The product's own source, parsed once, for the rules that contracts can't say."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PRODUCT = ("arena", "augment")


@cache
def modules() -> tuple[tuple[str, ast.Module], ...]:
    """(dotted name, tree) of every module but the migrations."""
    found = []
    for package in PRODUCT:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if "migrations" not in parts:
                name = ".".join(parts).removesuffix(".__init__")
                found.append((name, ast.parse(path.read_text(), filename=str(path))))
    return tuple(found)


@cache
def walked() -> tuple[tuple[str, tuple[ast.AST, ...]], ...]:
    """(dotted name, all nodes) of every module: to walk them takes longer than to look at them."""
    return tuple((name, tuple(ast.walk(tree))) for name, tree in modules())


def functions(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def imported(node: ast.Import | ast.ImportFrom) -> list[str]:
    """The full names that an import statement brings in."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""]


def dotted(node: ast.expr) -> str:
    """`np.random.normal` for the expression of that name, "" for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        before = dotted(node.value)
        return f"{before}.{node.attr}" if before else ""
    return ""
