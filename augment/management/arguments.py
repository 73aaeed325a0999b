"""Arguments that several commands share."""

from pathlib import Path
from typing import Any

from django.conf import settings

from augment.formats.readers import READERS
from augment.scene.entities import CatalogueSet
from augment.services.scenarios.catalogue import folder_of

FOLDER = {
    "--folder": {
        "type": Path,
        "default": settings.BASE_DIR / "fixtures",
        "help": "holds scenes/*.json and scenarios/*.json; default: the project's own",
    }
}

SOURCE: dict[str, dict[str, Any]] = {
    "source": {
        **{"nargs": "?", "metavar": "FORMAT"},
        "help": f"what PATH holds: {' or '.join(READERS)}; recognised when not given",
    },
    "path": {"type": Path, "help": "the file or folder"},
}


def sets_argument(default: str) -> dict[str, dict[str, Any]]:
    """Return --set paper|hard|all: which part of the catalogue."""
    choices = (*CatalogueSet, "all")
    return {
        "--set": {
            **{"dest": "sets", "choices": choices, "default": default},
            "help": f"default: {default}",
        }
    }


def sets_of(options: dict[str, Any]) -> tuple[CatalogueSet, ...]:
    """Return the sets that were asked for; of all sets those that the folder has."""
    if options["sets"] != "all":
        return (CatalogueSet(options["sets"]),)
    return tuple(one for one in CatalogueSet if folder_of(options["folder"], one).is_dir())
