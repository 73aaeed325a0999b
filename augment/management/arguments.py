"""Arguments that several commands share."""

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from django.conf import settings

from augment.scene.entities import CatalogueSet
from augment.services.scenarios.catalogue import folder_of


def add_folder_argument(parser: ArgumentParser) -> None:
    """--folder FOLDER: where the catalogue is."""
    parser.add_argument(
        "--folder",
        type=Path,
        default=settings.BASE_DIR / "fixtures",
        help="holds scenes/*.json and scenarios/*.json; default: the project's own",
    )


SETS = ("paper", "hard", "all")


def add_set_argument(parser: ArgumentParser, *, default: str) -> None:
    """--set paper|hard|all: which part of the catalogue."""
    parser.add_argument(
        "--set", dest="sets", choices=SETS, default=default, help=f"default: {default}"
    )


def sets_of(options: dict[str, Any]) -> tuple[CatalogueSet, ...]:
    """What was given; of all sets those that the folder has."""
    if options["sets"] != "all":
        return (CatalogueSet(options["sets"]),)
    return tuple(one for one in CatalogueSet if folder_of(options["folder"], one).is_dir())
