"""Mutations as they are kept: one table of a TOML file each, the file named for its area."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = Path(__file__).parent


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutation:
    """One change of one file.

    Attributes:
        area: The name of the file that keeps it.
        name: Its own name, unique.
        file: What is changed, from the root of the tree.
        old: The text, which stands there exactly once.
        new: What it becomes.
        tests: Which tests must notice, as pytest takes them.
        equivalent: Why nobody can notice; empty for one that must be noticed.
    """

    area: str
    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    equivalent: str = ""

    def apply(self, root: Path) -> str:
        """Change the file; what it was.

        Raises:
            ValueError: The old text does not stand there exactly once.
        """
        path = root / self.file
        text = path.read_text()
        if text.count(self.old) != 1:
            raise ValueError(f"{self.name}: its old text stands {text.count(self.old)} times")
        path.write_text(text.replace(self.old, self.new))
        return text


def mutations() -> list[Mutation]:
    """All of them, area by area."""
    return [
        Mutation(
            area=path.stem,
            name=name,
            file=given["file"],
            old=given["old"],
            new=given["new"],
            tests=tuple(given["tests"]),
            equivalent=given.get("equivalent", ""),
        )
        for path in sorted(FOLDER.glob("*.toml"))
        for name, given in tomllib.loads(path.read_text()).items()
    ]
