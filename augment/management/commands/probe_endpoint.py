"""Ask an endpoint what it can do."""

from typing import Any

from django.core.management.base import CommandError

from augment.llm.questions import Ability
from augment.services.endpoints import known_endpoints, known_models, probing
from augment.services.terminal import TerminalCommand

_WORDS = {True: "yes", False: "no", None: "unknown"}


class Command(TerminalCommand):
    """probe_endpoint LABEL --model M."""

    help = (
        "Ask an endpoint about six tiny questions (some 8,000 tokens in all) and store what its "
        "model can do: answer, take a temperature and native tools, see pictures, "
        "and read a long prompt to its beginning."
    )
    arguments = {
        "label": {"help": "the label of an endpoint"},
        "--model": {"required": True, "help": "the model id on the endpoint"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Ask, print a line for each question and fail where nobody answers."""
        endpoint = known_endpoints.find_endpoint(options["label"])
        report = probing.probe(known_models.model_at(endpoint=endpoint, model=options["model"]))
        for finding in report.findings:
            self.stdout.write(
                f"{finding.ability:14}{_WORDS[finding.has_it]:9}{finding.note}".rstrip()
            )
        cost = "cost unknown" if report.cost_usd is None else f"{report.cost_usd} USD"
        refused = ", ".join(report.refused) or "nothing"
        self.stdout.write(f"{report.calls} calls, {cost}; not taken: {refused}")
        if not report.has(Ability.ANSWERS):
            raise CommandError(f"{options['model']} at endpoint {endpoint.label} does not answer.")
