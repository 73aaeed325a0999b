"""manage.py judge_study: have a language model compare the pairs of a study."""

from typing import Any

from django.core.management.base import CommandParser

from arena.rating.agreement import share_text
from arena.results.queries.judges import judge_lines
from arena.results.services.agreement import judge_agreement, start_judge
from arena.studies.queries import study_named
from augment.services import TerminalCommand, add_options, read_request, to_inputs
from augment.services.running import JUDGEMENTS, JudgeRequest


class Command(TerminalCommand):
    """judge_study STUDY --endpoint E --model M [--cap-usd N]."""

    help = (
        "Ask a language model about every pair that experts judged, in both orders, and print how "
        "it agrees with them. What it says is no vote."
    )

    def add_arguments(self, parser: CommandParser) -> None:
        """Add the study and an option for each field of a judge run."""
        parser.add_argument("study", help="its name or its code")
        names = ("endpoint", "model")
        for name in names:
            parser.add_argument(f"--{name}", required=True)
        add_options(
            parser, [field for field in to_inputs(JudgeRequest) if field.name not in names]
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Ask about one pair after the other; workers may help."""
        study = study_named(options["study"])
        run = start_judge(study, read_request(JudgeRequest, options))
        for pk in run.judgements.values_list("pk", flat=True):
            JUDGEMENTS.perform(pk)
        line = next(line for line in judge_lines(study) if line.run.pk == run.pk)
        self.stdout.write(
            f"{line.name}: {line.run.get_state_display()}, {line.done} of {line.pairs} pairs; "
            f"preferences kept {line.kept}, lost {line.lost}, equal {line.equal}, "
            f"unreadable {line.unreadable}, failed {line.failed}."
        )
        agreement = judge_agreement(study, run.question).get(line.name)
        if agreement is not None:
            self.stdout.write(f"Agrees with the experts on {share_text(agreement.share)}.")
