"""Register a language model that runs one variant."""

from argparse import ArgumentParser
from typing import Any

from django.core.management.base import CommandError
from django.db import transaction

from augment.management.arguments import add_option_arguments, options_of_arguments
from augment.services.endpoints.contestants import add_contestant, ensure_builtin
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.endpoints.treatments import left_out
from augment.services.terminal import TerminalCommand
from augment.variants.respondents import ModelRole

ROLES = (ModelRole.REVIEWER, ModelRole.ENGINEER, ModelRole.VIEWER)


class Command(TerminalCommand):
    """add_contestant SLUG --variant V --endpoint E --model M [--reviewer M[@E]] ..."""

    help = (
        "Register a language model that runs one variant. With --base-url the endpoint is made "
        "in the same call; `--endpoint openai` needs no address where OPENAI_API_KEY is set."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """The contestant, and what a new endpoint needs."""
        parser.add_argument("slug", help="lower-case letters, digits and hyphens")
        parser.add_argument("--variant", required=True, help="the recipe, for example otm")
        parser.add_argument("--endpoint", required=True, help="the label of an endpoint")
        parser.add_argument("--model", required=True, help="the model id on the endpoint")
        parser.add_argument("--name", help="what people read; default: model and variant")
        for role in ROLES:
            parser.add_argument(
                f"--{role}",
                metavar="MODEL[@ENDPOINT]",
                help=f"who plays the {role}, where the variant has one; default: the model itself",
            )
        add_option_arguments(parser)
        new = parser.add_argument_group("a new endpoint")
        new.add_argument("--base-url", help="for example http://127.0.0.1:11434/v1")
        new.add_argument(
            "--key-variable",
            default="",
            help="the environment variable that holds the key where the worker runs",
        )
        new.add_argument(
            "--simulated",
            action="store_true",
            help="the endpoint is a stand-in; its contestants count as simulated",
        )
        new.add_argument(
            "--move-key",
            action="store_true",
            help="the endpoint exists, and its key may go to another server than so far",
        )

    @transaction.atomic
    def handle(self, *args: Any, **options: Any) -> None:
        """Make endpoint and contestant, or neither of them."""
        of_endpoints = [options["key_variable"], options["simulated"], options["move_key"]]
        if any(of_endpoints) and not options["base_url"]:
            raise CommandError("--key-variable, --simulated and --move-key need --base-url.")
        ensure_builtin()
        if options["base_url"]:
            ensure_endpoint(
                label=options["endpoint"],
                base_url=options["base_url"],
                key_variable=options["key_variable"],
                is_simulated=options["simulated"],
                may_move_key=options["move_key"],
            )
        contestant = add_contestant(
            **{name: options[name] for name in ("slug", "variant", "endpoint", "model", "name")},
            roles={role: _seat(options[role]) for role in ROLES if options[role]},
            options=options_of_arguments(options),
        )
        self.stdout.write(f"{contestant.slug}: {contestant.name} ({contestant.kind})")
        for role, names in left_out(contestant).items():
            self.stderr.write(
                f"The {role}'s model does not take {', '.join(names)}: not sent, and said so "
                "wherever the contestant is shown in full."
            )


def _seat(written: str) -> tuple[str | None, str]:
    """Return the endpoint, None without one, and the model; a model may have an @ of its own."""
    model, at, label = written.rpartition("@")
    return (label, model) if at else (None, label)
