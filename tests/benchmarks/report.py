"""Writing a benchmark's table into docs/benchmarks.md, each in its own section."""

from __future__ import annotations

import os
import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md"


def write_section(heading: str, text: str, *, page: Path = PAGE) -> None:
    """Replace what stands under a heading, or add it at the end."""
    kept = page.read_text()
    section = f"## {heading}\n\n{text.strip()}\n"
    found = re.search(rf"^## {re.escape(heading)}\n.*?(?=^## |\Z)", kept, re.M | re.S)
    if found is None:
        page.write_text(f"{kept.rstrip()}\n\n{section}")
    else:
        rest = kept[found.end() :]
        page.write_text(kept[: found.start()] + section + ("\n" + rest if rest else ""))


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(line) + " |" for line in (head, *rows)]
    lines.insert(1, "|" + "---|" * len(head))
    return "\n".join(lines)


def load() -> str:
    """How busy the machine is, for the sentence above a table."""
    return f"load average {os.getloadavg()[0]:.1f} before the start, {os.cpu_count()} cores"
