"""Writing a benchmark's table into the docs: a section of docs/benchmarks.md, or a block."""

import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "benchmarks.md"


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


def write_block(name: str, text: str, *, page: Path) -> None:
    """Replace what stands between the comments `figures: NAME` and `end of figures`.

    Raises:
        LookupError: The page has no such block.
    """
    begin, end = f"<!-- figures: {name} -->\n", "<!-- end of figures -->"
    before, found, rest = page.read_text().partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise LookupError(f"{page.name} has no block of figures {name!r}")
    page.write_text(f"{before}{begin}\n{text.strip()}\n\n{end}{after}")


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(line) + " |" for line in (head, *rows)]
    lines.insert(1, "|" + "---|" * len(head))
    return "\n".join(lines)


def load() -> str:
    """How busy the machine is, for the sentence above a table."""
    return f"load average {os.getloadavg()[0]:.1f} before the start, {os.cpu_count()} cores"
