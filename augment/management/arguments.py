"""Arguments that several commands share."""

from pathlib import Path
from typing import Any

from augment.formats.readers import READERS

SOURCE: dict[str, dict[str, Any]] = {
    "source": {
        **{"nargs": "?", "metavar": "FORMAT"},
        "help": f"what PATH holds: {' or '.join(READERS)}; recognised when not given",
    },
    "path": {"type": Path, "help": "the file or folder"},
}
