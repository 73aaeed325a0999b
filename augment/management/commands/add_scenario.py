"""Put an instruction to a stored scene."""

from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.errors import InvalidDocument
from augment.formats.documents import read_json
from augment.models.scenes import GOALS
from augment.scene.entities import ScenarioType, TrafficDensity
from augment.services.scenarios.bulk import DOCUMENTS, NEEDED, OPTIONAL, add_rows
from augment.services.scenarios.scenes import NewScenario, add_scenario
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """`manage.py add_scenario --scene SLUG --type TYPE --instruction TEXT`, or `--file FILE`."""

    help = "Add a scenario: a scene, its type, an instruction and, if given, a reference."

    arguments = {
        "--file": {
            "type": Path,
            "help": "many at once, all or none: .csv with a line of names, or .yaml with a list; "
            f"{', '.join(NEEDED)}, and {', '.join(OPTIONAL)} where they are known",
        },
        "--scene": {"help": "the slug of a stored scene"},
        "--type": {"help": f"one of {', '.join(ScenarioType)}, or a slug of your own"},
        "--instruction": {"help": "what is to be changed"},
        "--slug": {"help": "the scenario's name; made up from the others if absent"},
        "--reference": {
            **{"type": Path, "metavar": "FILE", "help": "a modification in the own JSON"}
        },
        "--intent": {
            **{"type": Path, "metavar": "FILE"},
            "help": "what the instruction asks for, see docs/catalogue.md",
        },
        "--keep-traffic": {
            "action": "store_true",
            "help": "keep the recorded traffic in the scene",
        },
        "--density": {
            "choices": list(TrafficDensity),
            "help": "spawn traffic in place of the recorded one",
        },
        "--goal": {"choices": list(GOALS), "help": "where the ego's way turns"},
        "--follows": {"help": "a scenario of the scene whose results it asks to change further"},
        "--variant-of": {"help": "a scenario that it was made from: one split of a benchmark"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Add, and say under which name."""
        if options["file"] is not None:
            self._add_many(options)
            return
        missing = [f"--{name}" for name in NEEDED if options[name] is None]
        if missing:
            raise CommandError(f"{', '.join(missing)} is needed, or --file FILE instead of all.")
        names = ("scene", "type", "instruction", "slug", "keep_traffic")
        values = {name: options[name] for name in names}
        values |= {
            name: options[name] or "" for name in ("density", "goal", "follows", "variant_of")
        }
        for name, what in DOCUMENTS.items():
            if (file := options[name]) is not None:
                values[name] = read_json(file, what=what)
                if values[name] is None:
                    raise InvalidDocument(what, [(file.name, "holds null")])
        scenario = add_scenario(NewScenario(**values))
        with_reference = "with" if scenario.reference is not None else "without"
        with_intent = "" if scenario.intent is None else ", with its intent"
        self.stdout.write(
            f"Added scenario {scenario.slug} {with_reference} a reference{with_intent}."
        )

    def _add_many(self, options: dict[str, Any]) -> None:
        superfluous = [
            f"--{name.replace('_', '-')}" for name in (*NEEDED, *OPTIONAL) if options[name]
        ]
        if superfluous:
            raise CommandError(f"--file says all of it; it goes without {', '.join(superfluous)}.")
        file: Path = options["file"]
        slugs = add_rows(file.name, file.read_bytes())
        for slug in slugs:
            self.stdout.write(f"Added scenario {slug}.")
        self.stdout.write(f"{len(slugs)} scenarios.")
