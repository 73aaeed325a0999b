"""manage.py import_votes: keep votes from elsewhere as a study that can be rated."""

from pathlib import Path
from typing import Any

from arena.studies.services.importing import import_votes
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Entry point of arena.results.services.vote_files.import_votes."""

    help = (
        "Import votes from a file (CSV, JSON, Parquet, Excel) with the columns model_a, "
        "model_b, winner (model_a, model_b, tie or tie (bothbad)), and maybe judge and item."
    )

    arguments = {
        "file": {"type": Path},
        "--name": {"help": "of the study; that of the file without its ending"},
        "--simulated": {
            "action": "store_true",
            "help": "the votes are made up; everything says so",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Import the file and say what it held."""
        path: Path = options["file"]
        imported = import_votes(
            path=path, name=options["name"] or path.stem, is_simulated=options["simulated"]
        )
        self.stdout.write(
            f"Imported {imported.votes} votes on {imported.contestants} contestants as "
            f"{imported.study.name!r} ({imported.study.code}). {imported.note}".rstrip()
        )
