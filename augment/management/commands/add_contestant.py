"""Register a language model that runs one variant."""

from __future__ import annotations

from argparse import ArgumentParser
from typing import Any

from django.core.management.base import CommandError
from django.db import transaction

from augment.management.arguments import add_option_arguments, options_of_arguments
from augment.models import Contestant
from augment.services.endpoints.contestants import add_contestant, add_like, ensure_builtin
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.endpoints.treatments import left_out
from augment.services.terminal import TerminalCommand
from augment.variants.respondents import ModelRole

ROLES = (ModelRole.REVIEWER, ModelRole.ENGINEER, ModelRole.VIEWER)

_COPIED = ("variant", "endpoint", "model")


class Command(TerminalCommand):
    """add_contestant SLUG --variant V --endpoint E --model M [--reviewer M[@E]] ..."""

    help = (
        "Register a language model that runs one variant. With --base-url the endpoint is made "
        "in the same call; `--endpoint openai` needs no address where OPENAI_API_KEY is set."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """The contestant, and what a new endpoint needs."""
        parser.add_argument("slug", help="lower-case letters, digits and hyphens")
        parser.add_argument("--variant", help="the recipe, for example otm")
        parser.add_argument("--endpoint", help="the label of an endpoint")
        parser.add_argument("--model", help="the model id on the endpoint")
        parser.add_argument(
            "--like",
            metavar="SLUG",
            help="take variant, endpoint, model, roles and options from this contestant, but for "
            "what is given beside it; with the prompts that are installed",
        )
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

    def handle(self, *args: Any, **options: Any) -> None:
        """Make the endpoint if an address is given, then the contestant."""
        needed = [name for name in ("variant", "endpoint", "model") if not options[name]]
        if options["like"] is None and needed:
            raise CommandError(f"Name {_flags(needed)}, or a contestant by --like.")
        of_endpoints = [
            name for name in ("key_variable", "simulated", "move_key") if options[name]
        ]
        if not options["base_url"] and of_endpoints:
            raise CommandError(f"{_flags(of_endpoints)} need --base-url.")
        contestant = self._add(options)
        self.stdout.write(f"{contestant.slug}: {contestant.name} ({contestant.kind})")
        for role, names in left_out(contestant).items():
            self.stderr.write(
                f"The {role}'s model does not take {', '.join(names)}: not sent, and said so "
                "wherever the contestant is shown in full."
            )

    @transaction.atomic
    def _add(self, options: dict[str, Any]) -> Contestant:
        """Endpoint and contestant, or neither of them."""
        ensure_builtin()
        if options["base_url"]:
            ensure_endpoint(
                label=options["endpoint"],
                base_url=options["base_url"],
                key_variable=options["key_variable"],
                is_simulated=options["simulated"],
                may_move_key=options["move_key"],
            )
        roles = {role: _seat(options[role]) for role in ROLES if options[role]}
        chosen = options_of_arguments(options)
        if options["like"] is not None:
            return add_like(
                slug=options["slug"],
                like=options["like"],
                changes={name: options[name] for name in _COPIED if options[name]},
                name=options["name"],
                roles=roles,
                options=chosen,
            )
        return add_contestant(
            slug=options["slug"],
            variant=options["variant"],
            endpoint=options["endpoint"],
            model=options["model"],
            name=options["name"],
            roles=roles,
            options=chosen,
        )


def _flags(names: list[str]) -> str:
    return ", ".join(f"--{name.removeprefix('option_').replace('_', '-')}" for name in names)


def _seat(written: str) -> tuple[str | None, str]:
    """The endpoint, None where there is none, and the model; a model may have an @ of its own."""
    model, at, label = written.rpartition("@")
    return (label, model) if at else (None, label)
