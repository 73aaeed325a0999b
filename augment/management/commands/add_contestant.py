"""Register a language model that runs one variant."""

from typing import Any

from django.core.management.base import CommandError, CommandParser
from django.db import transaction

from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.inputs import add_options, read_request, read_values, to_inputs
from augment.services.terminal import TerminalCommand
from augment.variants.respondents import ModelRole

ROLES = (ModelRole.REVIEWER, ModelRole.ENGINEER, ModelRole.VIEWER)
OF_ENDPOINTS = ("base_url", "key_variable", "is_simulated")


class Command(TerminalCommand):
    """add_contestant SLUG --variant V --endpoint E --model M [--reviewer M[@E]] ..."""

    help = (
        "Register a language model that runs one variant. With --base-url the endpoint is made "
        "in the same call; `--endpoint openai` needs no address where OPENAI_API_KEY is set."
    )

    def add_arguments(self, parser: CommandParser) -> None:
        """The contestant, and what a new endpoint needs."""
        add_options(parser, to_inputs(contestants.ContestantRequest))
        for role in ROLES:
            parser.add_argument(
                f"--{role}",
                metavar="MODEL[@ENDPOINT]",
                help=f"who plays the {role}, where the variant has one; default: the model itself",
            )
        add_options(parser.add_argument_group("how it asks"), contestants.OPTION_INPUTS)
        inputs = [field for field in to_inputs(EndpointRequest) if field.name in OF_ENDPOINTS]
        group = parser.add_argument_group("a new endpoint")
        add_options(group, inputs, is_any_required=False)

    @transaction.atomic
    def handle(self, *args: Any, **options: Any) -> None:
        """Make endpoint and contestant, or neither of them."""
        contestants.ensure_builtin()
        if options["base_url"]:
            ensure_endpoint(read_request(EndpointRequest, options, label=options["endpoint"]))
        elif options["key_variable"] or options["is_simulated"]:
            raise CommandError("--key-variable and --simulated need --base-url.")
        roles = {role: _seat(options[role]) for role in ROLES if options[role]}
        request = read_request(
            contestants.ContestantRequest,
            options,
            roles=roles,
            options=read_values(contestants.OPTION_INPUTS, options),
        )
        row = contestants.add_contestant(request)
        self.stdout.write(f"{row.slug}: {row.name} ({row.kind})")
        for role, names in contestants.list_unsent_options(row).items():
            self.stderr.write(f"Not sent, as the {role}'s model refuses it: {', '.join(names)}.")


def _seat(written: str) -> tuple[str | None, str]:
    """Return the endpoint, None without one, and the model; a model may have an @ of its own."""
    model, at, label = written.rpartition("@")
    return (label, model) if at else (None, label)
