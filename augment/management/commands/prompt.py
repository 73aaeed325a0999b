"""Print the exact messages that a variant sends for a scenario."""

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.errors import UnknownName
from augment.models import Scenario
from augment.services.scenarios.prompts import preview_prompt, prompt_version
from augment.services.terminal import TerminalCommand
from augment.variants.respondents import ModelRole


class Command(TerminalCommand):
    """prompt SCENARIO VARIANT [--role R] [--native-tools] [--picture FILE]."""

    help = (
        "Print the exact messages that a variant sends for a scenario, and an estimate of their "
        "tokens. Reviewers are shown the scenario's reference."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """What to show."""
        parser.add_argument("scenario", help="the slug of a scenario")
        parser.add_argument("variant", help="the recipe, for example otm")
        parser.add_argument(
            "--role", choices=[role.value for role in ModelRole], default=ModelRole.MODIFIER.value
        )
        parser.add_argument(
            "--native-tools", action="store_true", help="as for a model that calls tools natively"
        )
        parser.add_argument(
            "--picture", type=Path, metavar="FILE", help="where the viewer's PNG is written"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Print the messages, then what is known about them."""
        slug, rows = options["scenario"], Scenario.objects.select_related("base_scene")
        scenario = rows.filter(slug=slug).first()
        if scenario is None:
            raise UnknownName("scenario", slug, list(rows.values_list("slug", flat=True)))
        shown = preview_prompt(
            scenario,
            variant=options["variant"],
            role=options["role"],
            native_tools=options["native_tools"],
        )
        pictures = [png for message in shown.messages for png in message.images]
        if options["picture"] is not None:
            if not pictures:
                raise CommandError("Only the viewer is shown a picture: --role viewer.")
            self.write_file(options["picture"], pictures[0])
        for message in shown.messages:
            self.stdout.write(f"=== {message.speaker}\n{message.text}\n")
            for png in message.images:
                self.stdout.write(f"[a PNG of {len(png)} bytes]\n")
        for tool in shown.tools:
            self.stdout.write(f"=== tool\n{tool}\n")
        images = f" and {len(pictures)} picture" * bool(pictures)
        self.stdout.write("=== about this prompt")
        self.stdout.write(f"About {shown.tokens} tokens of text{images}")
        self.stdout.write(f"Prompt version {prompt_version()}")
