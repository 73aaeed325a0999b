"""One name, one thing: what the vocabulary in docs/architecture.md holds the product to."""

import ast
import re
from collections import defaultdict

from tests.house.source import ROOT, modules

SHARED = "Names that several classes may share:"
"""How the line of docs/architecture.md begins that lists them."""

BARE_PARTICIPLES = {"found", "given", "made", "one", "said", "seen", "told"}
"""What says nothing of what a function returns, and can't be searched for."""

PARTICIPLE = re.compile(r"(?!speed$)[a-z]+(ed|able|wn|ken)")
"""One word that says how something is, not what is done."""


def shared_names() -> set[str]:
    """The names that the vocabulary lets several classes have."""
    text = (ROOT / "docs" / "architecture.md").read_text()
    (line,) = [line for line in text.splitlines() if line.startswith(SHARED)]
    return set(re.findall(r"`(\w+)`", line))


def homes_of_classes() -> dict[str, list[str]]:
    """The modules that have a public class of each name."""
    homes: defaultdict[str, list[str]] = defaultdict(list)
    for name, tree in modules():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(name)
    return homes


def test_no_two_public_classes_share_a_name_unless_the_vocabulary_says_so() -> None:
    allowed = shared_names()
    shared = {name: homes for name, homes in homes_of_classes().items() if len(homes) > 1}
    assert {name: homes for name, homes in shared.items() if name not in allowed} == {}


def test_every_name_that_may_be_shared_is_shared() -> None:
    homes = homes_of_classes()
    assert {name for name in shared_names() if len(homes[name]) < 2} == set()


def test_no_function_of_a_module_is_called_by_a_bare_participle() -> None:
    functions = [
        f"{name}.{node.name}"
        for name, tree in modules()
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name in BARE_PARTICIPLES
    ]
    assert functions == []


def test_no_public_function_is_called_by_one_word_that_is_no_verb() -> None:
    """Template filters are: a page says `count|grouped`."""
    functions = [
        f"{name}.{node.name}"
        for name, tree in modules()
        if not name.startswith("arena.templatetags.")
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and PARTICIPLE.fullmatch(node.name)
    ]
    assert functions == []
