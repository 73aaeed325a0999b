"""Run mutations in a copy of the tree: `python -m tests.mutants [AREA or NAME ...]`.

Each one's tests run once as they are and once with it; it is caught where they fail. The table is
printed, and written to docs/mutants.md where all mutations ran.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.mutants.mutation import ROOT, Mutation, mutations

LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv", ".bench", "var", "media", "__pycache__", ".*_cache", "node_modules"
)
PASSED, FAILED = 0, 1
"""What pytest returns; anything else says that the tests did not run."""
LONGEST_S = 900
CAUGHT, SURVIVED, EQUIVALENT = "caught", "SURVIVED", "equivalent"


def main(wanted: Sequence[str]) -> int:
    chosen = [one for one in mutations() if not wanted or {one.area, one.name} & set(wanted)]
    with copied() as tree:
        green: dict[tuple[str, ...], bool] = {}
        found: list[tuple[Mutation, str]] = []
        for one in chosen:
            if one.tests not in green:
                green[one.tests] = run(tree, one.tests) == PASSED
            found.append((one, outcome(tree, one) if green[one.tests] else "red without it"))
            print(f"{one.area:13} {one.name:45} {found[-1][1]}", flush=True)
    if not wanted:
        (ROOT / "docs" / "mutants.md").write_text(report(found))
    bad = [one.name for one, came in found if came not in (CAUGHT, EQUIVALENT)]
    print(f"{len(found) - len(bad)} of {len(found)} noticed or equivalent", *bad, sep="\n  ")
    return 1 if bad else 0


def outcome(tree: Path, one: Mutation) -> str:
    """What became of one mutation; its file is as before afterwards."""
    was = one.apply(tree)
    try:
        ended = run(tree, one.tests)
    finally:
        (tree / one.file).write_text(was)
    if ended == FAILED:
        return CAUGHT if not one.equivalent else "not equivalent"
    if ended != PASSED:
        return f"tests did not run ({ended})"
    return EQUIVALENT if one.equivalent else SURVIVED


def run(tree: Path, tests: Sequence[str]) -> int:
    """The exit code of pytest; the database of the tests is made once for all."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", "--reuse-db"]
    command += ["-p", "no:cacheprovider", *tests]
    environment = {
        **os.environ,
        "ARENA_VAR_DIR": str(tree / "var"),
        "ARENA_MEDIA_DIR": str(tree / "media"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    environment.pop("DATABASE_URL", None)
    try:
        ended = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, timeout=LONGEST_S, check=False
        )
    except subprocess.TimeoutExpired:
        return FAILED  # it never ends with the mutation, and somebody would notice that
    return ended.returncode


@contextmanager
def copied() -> Iterator[Path]:
    """A copy of the tree: nothing is ever changed in place."""
    with tempfile.TemporaryDirectory(prefix="arena-mutants-") as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=LEFT_OUT)
        yield tree


def report(found: Sequence[tuple[Mutation, str]]) -> str:
    """The page of docs."""
    caught = sum(came == CAUGHT for _, came in found)
    equal = sum(came == EQUIVALENT for _, came in found)
    lines = [
        "# Mutations",
        "",
        "Tests are worth what they notice. `make mutants` changes one small thing at a time in a",
        "copy of the tree and runs the tests that must then fail; `tests/mutants/*.toml` keeps",
        "the changes, and this page is what came of the last run. It is not part of `make test`,",
        "which only checks that every change still fits the source.",
        "",
        f"{caught} of {len(found)} are caught; {equal} change nothing that anybody could notice.",
        "",
        "| area | mutation | in | what came of it |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {one.area} | {one.name.replace('-', ' ')} | `{one.file}` | "
        f"{came}{': ' + one.equivalent if came == EQUIVALENT else ''} |"
        for one, came in found
    ]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
