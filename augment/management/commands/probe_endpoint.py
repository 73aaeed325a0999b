"""Ask an endpoint what it can do."""

from __future__ import annotations

from argparse import ArgumentParser
from typing import Any

from django.core.management.base import CommandError

from augment.errors import UnknownName
from augment.llm.questions import Ability
from augment.models import Endpoint
from augment.services.endpoints.known_models import tell_sight
from augment.services.endpoints.probing import ProbeFinding, ProbeReport, probe
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
        label = options["label"]
        if not Endpoint.objects.filter(label=label).exists():
            known = list(Endpoint.objects.values_list("label", flat=True))
            raise UnknownName("endpoint", label, known)
        if options["sees"]:
            self._tell(label, options["model"], sees=options["sees"] == "yes")
            return
        report = probe(label=label, model=options["model"])
        for finding in report.findings:
            self.stdout.write(_line(finding))
        self._sum_up(report)
        if not report.has(Ability.ANSWERS):
            raise CommandError(f"{options['model']} at endpoint {label} does not answer.")

    def _tell(self, label: str, model: str, *, sees: bool) -> None:
        endpoint = Endpoint.objects.get(label=label)
        tell_sight(endpoint=endpoint, model=one_line("model", model, what="endpoint"), sees=sees)
        self.stdout.write(f"{'vision':14}{_WORDS[sees]:9}as you say")

    def _sum_up(self, report: ProbeReport) -> None:
        self.stdout.write(f"{'usage':14}{_WORDS[report.counts_tokens]}")
        returned = ", ".join(report.models_returned) or "unknown"
        self.stdout.write(f"{'model id':14}{returned}")
        if report.refused:
            self.stdout.write(f"{'not taken':14}{', '.join(report.refused)}")
        cost = "unknown" if report.cost_usd is None else f"{report.cost_usd} USD"
        calls = "1 call" if report.calls == 1 else f"{report.calls} calls"
        self.stdout.write(f"{'cost':14}{cost}, {calls}")


def _line(finding: ProbeFinding) -> str:
    tokens = "" if finding.prompt_tokens is None else f"{finding.prompt_tokens} tokens in"
    return f"{finding.ability:14}{_WORDS[finding.has_it]:9}{tokens:16}{finding.note}".rstrip()
