"""Python environments of what a benchmark runs beside the project."""

import hashlib
import os
import subprocess
import venv
from collections.abc import Mapping
from pathlib import Path

from bench.report import ROOT


def make_environment(folder: Path, *, variables: Mapping[str, str] | None = None) -> Path:
    """Return the interpreter of a folder's environment, made anew where its lock changed.

    Args:
        folder: Holds requirements.txt.
        variables: Set while it is installed.
    """
    lock, made = folder / "requirements.txt", ROOT / ".bench" / folder.name
    stamp, python = made / "installed", made / "bin" / "python"
    digest = hashlib.sha256(lock.read_bytes()).hexdigest()
    if not stamp.exists() or stamp.read_text() != digest:
        print(f"Installing into {made} ...", flush=True)
        venv.create(made, with_pip=True, clear=True)
        # pip's cache may hold what was compiled with other settings.
        pip = [str(python), "-m", "pip", "install", "--quiet", "--no-cache-dir"]
        command = [*pip, "--require-hashes", "--requirement", str(lock)]
        subprocess.run(command, check=True, env={**os.environ, **(variables or {})})
        stamp.write_text(digest)
    return python
