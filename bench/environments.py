"""Making a bench's own environment from its lock file, once."""

import hashlib
import os
import subprocess
import sys
import venv
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

ROOT = Path(__file__).resolve().parents[1]
BENCH = Path(__file__).parent


class NotInstalled(Exception):
    """It can't be installed here (no package index, no room); the text is pip's last line."""


def python_of(
    name: str, lock: Path | None = None, settings: Mapping[str, str] = MappingProxyType({})
) -> Path:
    """Return the interpreter of a bench's own environment, made or renewed where the lock changed.

    Args:
        settings: Environment variables for what pip compiles.

    Raises:
        NotInstalled: pip could not install what the lock names.
    """
    lock = lock or BENCH / name / "requirements.txt"
    folder = ROOT / ".bench" / name
    stamp = folder / "installed"
    digest = hashlib.sha256(lock.read_bytes()).hexdigest()
    python = folder / "bin" / "python"
    if stamp.exists() and stamp.read_text() == digest:
        return python
    print(f"Installing {name} into {folder} ...", flush=True)
    venv.create(folder, with_pip=True, clear=True)
    arguments = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if settings:
        arguments.append("--no-cache-dir")  # which holds what was compiled with other settings
    ended = subprocess.run(
        [*arguments, "--require-hashes", "--requirement", str(lock)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        env={**os.environ, **settings},
    )
    if ended.returncode:
        said = ended.stderr.strip().splitlines() or ["pip said nothing"]
        raise NotInstalled(f"{name} can't be installed: {said[-1]}")
    stamp.write_text(digest)
    return python


if __name__ == "__main__":
    print(python_of(sys.argv[1]))
