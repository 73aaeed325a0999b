"""Bring the catalogue's scenes and scenarios into the database."""

from pathlib import Path
from typing import Any

from django.conf import settings

from augment.scene.entities import CatalogueSet
from augment.services.scenarios.catalogue import CatalogueStep, load_catalogue, set_folder
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """load_catalogue [--set NAME|all] [--paraphrases] [--folder FOLDER]."""

    help = (
        "Load the catalogue: base scenes, instructions and reference modifications. "
        "Running it again changes nothing."
    )

    arguments = {
        "--folder": {
            **{"type": Path, "default": settings.BASE_DIR / "fixtures"},
            "help": "holds scenes/*.json and scenarios/*.json; default: the project's own",
        },
        "--set": {
            **{"choices": [*CatalogueSet, "all"], "default": "paper"},
            "help": "which part of it; all: those that the folder has; default: paper",
        },
        "--paraphrases": {
            "action": "store_true",
            "help": "also every paraphrase, as a scenario beside the one that it says anew",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Load it and say what that changed."""
        folder, sets = options["folder"], [options["set"]]
        if sets == ["all"]:
            sets = [name for name in CatalogueSet if set_folder(folder, name).is_dir()]
        paraphrased = options["paraphrases"]
        report = load_catalogue(folder=folder, sets=sets, with_paraphrases=paraphrased)
        for kind, counts in (("scenes", report.scenes), ("scenarios", report.scenarios)):
            steps = ", ".join(f"{counts[step]} {step}" for step in list(CatalogueStep)[:4])
            self.stdout.write(f"{kind}: {steps}")
        if report.kept:
            self.stdout.write(
                "kept as stored, because their scene was augmented, although the catalogue has a "
                f"newer version: {', '.join(report.kept)}"
            )
