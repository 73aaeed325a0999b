"""A copy of the tree in which tests run, with one file exchanged at a time."""

import multiprocessing
import os
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.mutation import ROOT, Mutation
from tests.processes import MIGRATED

LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv", ".bench", "var", "media", "__pycache__", ".*_cache", ".hypothesis"
)
PASSED, FAILED = 0, 1
"""What pytest returns; anything else says that the tests did not run."""
LONGEST_S = 1_800
OPTIONS = (
    *("-q", "--no-header", "--tb=no", "--timeout=60", "--reuse-db", "--hypothesis-seed=0"),
    *("-p", "no:cacheprovider", "--randomly-dont-reorganize"),
    *("-W", "ignore:Module already imported:pytest.PytestAssertRewriteWarning"),
)
LIBRARIES = (
    *("numpy", "scipy.optimize", "scipy.stats", "scipy.special", "scipy.spatial", "shapely"),
    *("pytest", "hypothesis", "hypothesis.strategies", "pydantic", "openai", "PIL.Image"),
    *("django.db", "django.db.models", "django.test", "redis", "celery", "kombu"),
)
"""Loaded once for all runs: else that is most of what a run takes."""
FRESH = multiprocessing.get_context("forkserver")
FRESH.set_forkserver_preload(list(LIBRARIES))
OURS = ("arena", "augment", "tests")
NOTICED = re.compile(r"^(?:FAILED|ERROR) (tests/\S+?::\w+)", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """How some tests ended.

    Attributes:
        code: What pytest returned.
        failed: The tests that failed, without their parameters.
        said: All that pytest said.
    """

    code: int
    failed: tuple[str, ...]
    said: str


class Tree:
    """A copy of the tree with a database of its own, as new for every run.

    It is migrated once for all trees, by the first run that needs it; but what stands under
    models is part of the database, so that a mutation there gets one that is made for it.
    """

    def __init__(self, folder: Path) -> None:
        self.root = folder / "tree"
        self._run_files = folder / "run"
        self._migrated = folder.parent / MIGRATED
        self._is_database_usual = True
        shutil.copytree(ROOT, self.root, ignore=LEFT_OUT)

    def run(self, tests: Sequence[str], *, to_the_end: bool = False) -> Run:
        """Run tests, up to the first that fails or all of them."""
        var = self.root / "var"
        shutil.rmtree(var, ignore_errors=True)
        if self._is_database_usual and self._migrated.exists():
            var.mkdir(mode=0o700)
            shutil.copy(self._migrated, var / "test.sqlite3")
        options = [f"--basetemp={self._run_files}", *([] if to_the_end else ["-x"])]
        said = self.root.parent / "said.txt"
        child = FRESH.Process(
            target=_run_here, args=(self.root, [*OPTIONS, *options, *tests], said)
        )
        child.start()
        child.join(LONGEST_S)
        if child.exitcode is None:
            child.kill()
            child.join()
        made = self._run_files / MIGRATED
        if self._is_database_usual and made.exists() and not self._migrated.exists():
            made.rename(self._migrated)
        told = said.read_text(errors="replace")
        failed = tuple(dict.fromkeys(NOTICED.findall(told)))
        return Run(code=child.exitcode or 0, failed=failed, said=told)

    @contextmanager
    def mutated(self, one: Mutation) -> Iterator[None]:
        """The tree with one mutation; its file is as before afterwards."""
        was = one.apply(self.root)
        self._forget_compiled(one.file)
        self._is_database_usual = "/models/" not in one.file
        try:
            yield
        finally:
            self._is_database_usual = True
            (self.root / one.file).write_text(was)
            self._forget_compiled(one.file)

    def _forget_compiled(self, file: str) -> None:
        """What is compiled counts as fresh by the second and the size: both may be the same."""
        path = self.root / file
        for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
            compiled.unlink()


def _run_here(root: Path, arguments: Sequence[str], said: Path) -> None:
    """In a process of its own: run tests of the tree as if nothing of ours had been loaded."""
    for name in [name for name in sys.modules if name.split(".")[0] in OURS]:
        del sys.modules[name]
    sys.path[:] = [str(root), *(path for path in sys.path if path not in ("", str(ROOT)))]
    sys.dont_write_bytecode = False
    os.chdir(root)
    os.environ["ARENA_TESTS_VAR"] = str(root / "var")
    with said.open("wb") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    import pytest

    code = pytest.main(list(arguments))
    sys.stdout.flush()
    os._exit(code)
