"""A copy of the tree in which tests run, with one file exchanged at a time."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
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
LONGEST_S = 600
QUIETLY = ("-m", "pytest", "-q", "--no-header", "--tb=no", "--timeout=60")
ALWAYS_THE_SAME = ("-p", "no:cacheprovider", "-p", "no:randomly", "--hypothesis-seed=0")
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
    """A copy of the tree with a database of its own, migrated once and as new for every run."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "tree"
        self._run_files = folder / "run"
        self._migrated = folder / MIGRATED
        shutil.copytree(ROOT, self.root, ignore=LEFT_OUT)

    def run(self, tests: Sequence[str], *, to_the_end: bool = False) -> Run:
        """Run tests, up to the first that fails or all of them."""
        var = self.root / "var"
        shutil.rmtree(var, ignore_errors=True)
        if self._migrated.exists():
            var.mkdir(mode=0o700)
            shutil.copy(self._migrated, var / "test.sqlite3")
        command = [sys.executable, *QUIETLY, *ALWAYS_THE_SAME, "--reuse-db"]
        command += [f"--basetemp={self._run_files}", *([] if to_the_end else ["-x"]), *tests]
        kept = {name: value for name, value in os.environ.items() if name != "DATABASE_URL"}
        environment = {**kept, "PYTHONDONTWRITEBYTECODE": ""}
        try:
            ended = subprocess.run(
                command,
                cwd=self.root,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                timeout=LONGEST_S,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            return Run(code=-1, failed=(), said=f"not within {error.timeout:g} s")
        made = self._run_files / MIGRATED
        if made.exists() and not self._migrated.exists():
            shutil.copy(made, self._migrated)
        failed = tuple(dict.fromkeys(NOTICED.findall(ended.stdout)))
        return Run(code=ended.returncode, failed=failed, said=ended.stdout)

    @contextmanager
    def mutated(self, one: Mutation) -> Iterator[None]:
        """The tree with one mutation; its file is as before afterwards."""
        was = one.apply(self.root)
        self._forget_compiled(one.file)
        try:
            yield
        finally:
            (self.root / one.file).write_text(was)
            self._forget_compiled(one.file)

    def _forget_compiled(self, file: str) -> None:
        """What is compiled counts as fresh by the second and the size: both may be the same."""
        path = self.root / file
        for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
            compiled.unlink()
