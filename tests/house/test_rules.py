"""Rules of the house that the import contracts can't say."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter

import pytest

from tests.house.source import ROOT, dotted, functions, imported, modules, walked

HEAVY = {
    "openai": ("augment.llm.openai_wire",),
    "httpx2": (*("augment.llm.openai_wire", "augment.llm.wire_transport"),),
    "httpcore2": ("augment.llm.wire_transport",),
    "genai_prices": ("augment.services.endpoints.known_models",),
    "pandas": ("augment.formats", "arena.exports"),
    "pyarrow": ("augment.formats", "arena.exports", "arena.rating.votes_file"),
    "openpyxl": ("arena.rating.votes_file",),
    "scenariogeneration": ("augment.formats",),
    "matplotlib": tuple(
        f"arena.{room}exports" for room in ("", "jobs.", "results.", "scenarios.")
    ),
    "scipy.interpolate": ("augment.formats", "augment.scene"),
    "scipy.optimize": (
        *("augment.benchmark", "augment.metrics", "arena.pairing"),
        "augment.checks.wish_patterns",
    ),
    "scipy.signal": ("augment.simulation",),
    "scipy.sparse": ("arena.rating",),
    "scipy.spatial": ("augment.formats", "augment.simulation"),
    "scipy.stats": ("arena.rating", "augment.metrics"),
}
READS_SETTINGS = (
    "arena.config",
    *(
        "arena.services",
        "arena.voting.services",
        "arena.tasks",
        "arena.apps",
        "arena.management",
        "arena.serving",
    ),
    *("augment.services", "augment.tasks", "augment.apps", "augment.management"),
)
MOST_LINES = {
    **dict.fromkeys(("arena", "augment", "bench", "tests"), ("*.py", 500)),
    "static": ("*.js", 400),
}
"""Of a file, by the folder that it lies in."""
SEEDED = {"Random", "default_rng", "Generator", "SeedSequence", "PCG64", "BitGenerator"}
FORBIDDEN_NAMES = {"utils", "helpers", "common", "base", "manager"}


def within(name: str, packages: tuple[str, ...]) -> bool:
    return any(name == package or name.startswith(package + ".") for package in packages)


def heavy_of(name: str) -> str | None:
    return next((heavy for heavy in HEAVY if within(name, (heavy,))), None)


def test_every_command_escapes_what_it_prints() -> None:
    commands = {
        name: [dotted(base) for base in node.bases]
        for name, tree in modules()
        if ".management.commands." in name
        for node in tree.body
        if isinstance(node, ast.ClassDef) and node.name == "Command"
    }
    assert len(commands) >= 26
    assert {name: bases for name, bases in commands.items() if bases != ["TerminalCommand"]} == {}


def test_randomness_is_an_argument() -> None:
    # `random.Random` and `default_rng` make generators with a seed of their own; the functions of
    # the modules share one.
    shared = re.compile(r"(np\.|numpy\.)?random\.(\w+)")
    found = [
        f"{name}:{node.lineno} {called}"
        for name, nodes in walked()
        for node in nodes
        if isinstance(node, ast.Attribute)
        for called in [dotted(node)]
        for match in [shared.fullmatch(called)]
        if match and match.group(2) not in SEEDED
    ] + [
        f"{name}:{node.lineno} imports {alias.name} from random"
        for name, nodes in walked()
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module == "random"
        for alias in node.names
        if alias.name not in SEEDED
    ]
    assert found == []


def test_settings_are_read_only_where_processes_are_put_together() -> None:
    found = [
        f"{name}:{node.lineno}"
        for name, nodes in walked()
        for node in nodes
        if isinstance(node, ast.ImportFrom)
        and node.module == "django.conf"
        and not within(name, READS_SETTINGS)
        and not {"models", "services"} & set(name.split("."))  # models: the user model's name
    ]
    assert found == []


def test_models_read_only_the_name_of_the_user_model() -> None:
    found = [
        f"{name}:{node.lineno} {dotted(node)}"
        for name, nodes in walked()
        if "models" in name.split(".")
        for node in nodes
        if isinstance(node, ast.Attribute)
        and dotted(node).startswith("settings.")
        and node.attr != "AUTH_USER_MODEL"
    ]
    assert found == []


def test_only_heavy_packages_are_imported_inside_functions_and_only_by_their_owners() -> None:
    found = []
    trees = dict(modules())
    for name, nodes in walked():
        tree = trees[name]
        inner = {
            id(node)
            for function in nodes
            if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
            for node in ast.walk(function)
            if isinstance(node, ast.Import | ast.ImportFrom)
        }
        for node in nodes:
            if not isinstance(node, ast.Import | ast.ImportFrom):
                continue
            for target in imported(node):
                heavy = heavy_of(target)
                if id(node) in inner and (heavy is None or not within(name, HEAVY[heavy])):
                    found.append(f"{name}:{node.lineno} imports {target} inside a function")
                if id(node) not in inner and heavy is not None and not _for_types(tree, node):
                    found.append(f"{name}:{node.lineno} imports {target} at its start")
    assert found == []


def _for_types(tree: ast.Module, wanted: ast.AST) -> bool:
    """Whether the import stands under `if TYPE_CHECKING:`."""
    return any(
        wanted in ast.walk(node)
        for node in tree.body
        if isinstance(node, ast.If) and dotted(node.test).endswith("TYPE_CHECKING")
    )


def test_no_package_is_called_a_drawer() -> None:
    found = [name for name, _ in modules() if set(name.split(".")) & FORBIDDEN_NAMES]
    assert found == []


def test_no_error_is_swallowed_whole() -> None:
    """Whoever catches everything passes it on, or logs it with its traceback."""
    found = [
        f"{name}:{node.lineno}"
        for name, nodes in walked()
        for node in nodes
        if isinstance(node, ast.ExceptHandler)
        and (node.type is None or dotted(node.type) in {"Exception", "BaseException"})
        and not any(_passes_on(inner) for inner in ast.walk(node))
    ]
    assert found == []


def _passes_on(node: ast.AST) -> bool:
    return isinstance(node, ast.Raise) or (
        isinstance(node, ast.Call) and dotted(node.func) == "logger.exception"
    )


def test_functions_stay_small() -> None:
    long = [
        f"{name}:{function.lineno} {function.name}"
        for name, tree in modules()
        for function in functions(tree)
        if (function.end_lineno or 0) - function.lineno + 1 > 60
    ]
    assert long == []


def test_files_stay_small() -> None:
    big = [
        f"{path.relative_to(ROOT)}: {lines} lines, at most {most}"
        for folder, (ending, most) in MOST_LINES.items()
        for path in (ROOT / folder).rglob(ending)
        for lines in [len(path.read_text().splitlines())]
        if "migrations" not in path.parts and lines > most
    ]
    assert big == []


def test_templates_hold_no_inline_script_style_or_unescaped_text() -> None:
    wrong = re.compile(r"<script>|<style|\sstyle=|\son\w+=[\"']|\|\s*safe\b|autoescape off", re.I)
    found = [
        f"{path.relative_to(ROOT)}: {match.group()}"
        for path in sorted((ROOT / "templates").rglob("*.html"))
        for match in [wrong.search(path.read_text())]
        if match
    ]
    assert found == []


@pytest.mark.parametrize(
    ("start", "frameworks"),
    [
        ("arena.config.wsgi, arena.config.urls", {"django", "celery", "redis"}),
        ("arena.rating.leaderboard", set()),
        ("arena.management.rate_csv", set()),
    ],
    ids=["a web worker", "the rating alone", "rate_csv"],
)
def test_no_heavy_package_is_loaded_at_start(start: str, frameworks: set[str]) -> None:
    code = f"import sys, {start}; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    forbidden = HEAVY.keys() | ({"django", "celery", "redis"} - frameworks)
    assert forbidden & set(loaded) == set()


def test_no_modules_import_each_other_in_a_circle() -> None:
    names = {name for name, _ in modules()}
    graph = {
        name: {
            target
            for node in tree.body
            if isinstance(node, ast.ImportFrom) and node.module
            for alias in node.names
            for target in (f"{node.module}.{alias.name}", node.module)
            if target in names - {name}
            and (target != node.module or f"{target}.{alias.name}" not in names)
        }
        for name, tree in modules()
    }
    TopologicalSorter(graph).prepare()  # raises with the circle in it
