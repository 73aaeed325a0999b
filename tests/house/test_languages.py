"""Only the modules whose words voters read know languages."""

import ast

from tests.house.messages import VOTER_MODULES
from tests.house.source import walked

CHOOSING = {"arena.site.language"}
"""It chooses the language of an answer and marks no text."""


def test_only_modules_of_the_catalogue_translate() -> None:
    known = CHOOSING | {name.removesuffix(".py").replace("/", ".") for name in VOTER_MODULES}
    found = [
        f"{name}:{node.lineno}"
        for name, nodes in walked()
        if name not in known
        for node in nodes
        if isinstance(node, ast.ImportFrom)
        and (
            node.module == "django.utils.translation"
            or (
                node.module == "django.utils" and "translation" in {one.name for one in node.names}
            )
        )
    ]
    assert found == []
