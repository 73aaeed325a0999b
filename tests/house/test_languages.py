"""Who may know a language: the doors. What is stored, logged or exported stays English."""

from __future__ import annotations

import ast

from tests.house.source import walked

DOORS = ("arena.web", "arena.templatetags", "arena.api", "arena.config.faults")
WORDING = "augment.services.wording"
MARKS = {"gettext_noop"}
LABELS = {"arena.models": {"gettext_lazy"}}
"""Labels of choices are said when a page shows them; the value is what is stored."""


def within(name: str, packages: tuple[str, ...]) -> bool:
    return any(name == package or name.startswith(package + ".") for package in packages)


def allowed(name: str) -> set[str]:
    return MARKS.union(*(kinds for floor, kinds in LABELS.items() if within(name, (floor,))))


def test_only_doors_translate() -> None:
    found = [
        f"{name}:{node.lineno} {alias.name}"
        for name, nodes in walked()
        if not within(name, (*DOORS, WORDING))
        for node in nodes
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("django.utils.tra")
        for alias in node.names
        if alias.name not in allowed(name)
    ]
    assert found == []


def test_only_doors_have_sentences_said() -> None:
    found = [
        f"{name}:{node.lineno}"
        for name, nodes in walked()
        if not within(name, DOORS)
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module == WORDING
    ]
    assert found == []


def test_pages_show_no_error_as_it_stands() -> None:
    found = [
        f"{name}:{node.lineno}"
        for name, nodes in walked()
        if within(name, ("arena.web",))
        for handler in nodes
        if isinstance(handler, ast.ExceptHandler) and handler.name
        for node in ast.walk(handler)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "str"
        and any(isinstance(one, ast.Name) and one.id == handler.name for one in node.args)
    ]
    assert found == []
