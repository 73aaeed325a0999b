"""Ask an endpoint what it can do."""

from argparse import ArgumentParser
from typing import Any

from django.core.management.base import CommandError

from augment.llm.questions import Ability
from augment.services.endpoints.known_endpoints import find_endpoint
from augment.services.endpoints.known_models import tell_sight
from augment.services.endpoints.probing import probe
from augment.services.terminal import TerminalCommand
from augment.services.texts import one_line

_WORDS = {True: "yes", False: "no", None: "unknown"}


class Command(TerminalCommand):
    """probe_endpoint LABEL --model M [--sees yes|no]."""

    help = (
        "Ask an endpoint about six tiny questions (some 8,000 tokens in all) and store what its "
        "model can do: answer, take a temperature, a JSON schema and native tools, see pictures, "
        "and read a long prompt to its beginning."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Who is asked."""
        parser.add_argument("label", help="the label of an endpoint")
        parser.add_argument("--model", required=True, help="the model id on the endpoint")
        parser.add_argument(
            "--sees",
            choices=("yes", "no"),
            help="ask nothing; note that the model sees pictures, or that it does not",
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Ask, print a table and fail where nobody answers."""
        endpoint = find_endpoint(options["label"])
        model = one_line("model", options["model"], what="endpoint")
        if options["sees"]:
            sees = options["sees"] == "yes"
            tell_sight(endpoint=endpoint, model=model, sees=sees)
            self.stdout.write(f"{'vision':14}{_WORDS[sees]:9}as you say")
            return
        report = probe(label=endpoint.label, model=model)
        for found in report.findings:
            tokens = "" if found.prompt_tokens is None else f"{found.prompt_tokens} tokens in"
            line = f"{found.ability:14}{_WORDS[found.has_it]:9}{tokens:16}{found.note}"
            self.stdout.write(line.rstrip())
        cost = "unknown" if report.cost_usd is None else f"{report.cost_usd} USD"
        facts = {
            "usage": _WORDS[report.counts_tokens],
            "model id": ", ".join(report.models_returned) or "unknown",
            "not taken": ", ".join(report.refused),
            "cost": f"{cost}, {report.calls} call{'s' * (report.calls != 1)}",
        }
        for name, fact in facts.items():
            if fact:
                self.stdout.write(f"{name:14}{fact}")
        if not report.has(Ability.ANSWERS):
            raise CommandError(f"{model} at endpoint {endpoint.label} does not answer.")
