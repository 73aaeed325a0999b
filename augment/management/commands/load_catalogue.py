"""Bring the catalogue's scenes and scenarios into the database."""

from typing import Any

from augment.management.arguments import FOLDER, sets_argument, sets_of
from augment.services.scenarios.catalogue import CatalogueStep, load_catalogue
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """load_catalogue [--set paper|hard|all] [--paraphrases] [--folder FOLDER]."""

    help = (
        "Load the catalogue: base scenes, instructions and reference modifications. "
        "Running it again changes nothing."
    )

    arguments = {
        **FOLDER,
        **sets_argument("paper"),
        "--paraphrases": {
            "action": "store_true",
            "help": "also every paraphrase, as a scenario beside the one that it says anew",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Load it and say what that changed."""
        report = load_catalogue(
            folder=options["folder"],
            sets=sets_of(options),
            with_paraphrases=options["paraphrases"],
        )
        for kind, counts in (("scenes", report.scenes), ("scenarios", report.scenarios)):
            steps = ", ".join(f"{counts[step]} {step}" for step in list(CatalogueStep)[:3])
            self.stdout.write(f"{kind}: {steps}")
        if report.kept:
            self.stdout.write(
                "kept as stored, because they or their scene were augmented, although the "
                f"catalogue has a newer version: {', '.join(report.kept)}"
            )
