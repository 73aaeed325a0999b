"""Print the exact messages that a variant sends for a scenario."""

from typing import Any

from augment.services.scenarios.prompts import preview_prompt, prompt_version
from augment.services.scenarios.scenes import scenario_named
from augment.services.terminal import TerminalCommand
from augment.variants.respondents import ModelRole


class Command(TerminalCommand):
    """prompt SCENARIO VARIANT [--role R] [--native-tools]."""

    help = (
        "Print the exact messages that a variant sends for a scenario, and an estimate of their "
        "tokens. Reviewers are shown the scenario's reference."
    )

    arguments = {
        "scenario": {"help": "the slug of a scenario"},
        "variant": {"help": "the recipe, for example otm"},
        "--role": {"choices": list(ModelRole), "default": ModelRole.MODIFIER.value},
        "--native-tools": {
            "action": "store_true",
            "help": "as for a model that calls tools natively",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Print the messages, then what is known about them."""
        shown = preview_prompt(
            scenario_named(options["scenario"]),
            variant=options["variant"],
            role=options["role"],
            native_tools=options["native_tools"],
        )
        for message in shown.messages:
            self.stdout.write(f"=== {message.speaker}\n{message.text}\n")
            for png in message.images:
                self.stdout.write(f"[a PNG of {len(png)} bytes]\n")
        for tool in shown.tools:
            self.stdout.write(f"=== tool\n{tool}\n")
        self.stdout.write("=== about this prompt")
        self.stdout.write(f"About {shown.tokens} tokens of text")
        self.stdout.write(f"Prompt version {prompt_version()}")
