"""manage.py plan_study: how many votes a study needs, and what they will tell."""

from dataclasses import asdict
from typing import Any

from django.core.management.base import CommandError, CommandParser

from arena.models import Study
from arena.rating.planning import Outlook, Prospect, Question, Wish, foretell
from arena.studies.services.outlook import ESTIMATE_INPUTS, StudyEstimate, known_of, usual_seconds
from augment.errors import AugmentError
from augment.services.inputs import add_options, check_bounds
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """The door to arena.rating.planning."""

    help = "Work out the votes of a study before there is one; needs nothing in the database."

    def add_arguments(self, parser: CommandParser) -> None:
        """The design; whatever is left open is taken from the study, else guessed."""
        parser.add_argument("--like", metavar="STUDY", help="name of a study to take numbers from")
        add_options(parser, ESTIMATE_INPUTS)
        parser.set_defaults(**dict.fromkeys(one.name for one in ESTIMATE_INPUTS))

    def handle(self, *args: Any, **options: Any) -> None:
        """Say what it takes."""
        names = [one.name for one in ESTIMATE_INPUTS]
        given = {name: options[name] for name in names if options[name] is not None}
        known = self._known(options["like"])
        estimate = StudyEstimate(**known | given)
        try:
            check_bounds(estimate)
            question = estimate.question()
        except (AugmentError, ValueError) as error:
            raise CommandError(str(error)) from error
        for name, value in asdict(estimate).items():
            origin = "given" if name in given else "known" if name in known else "guessed"
            if value is not None:
                self.stdout.write(f"{name.replace('_', ' ')}: {value:g} ({origin})")
        self._say(question, foretell(question))

    def _known(self, name: str | None) -> dict[str, Any]:
        if name is None:
            seconds = usual_seconds()
            return {} if seconds is None else {"seconds": seconds}
        study = Study.objects.filter(name=name).first()
        if study is None:
            raise CommandError(f"There is no study named {name!r}.")
        return known_of(study).values

    def _say(self, question: Question, found: Outlook) -> None:
        self.stdout.write("")
        self._say_wish(
            f"Expected widest interval ±{question.half_width:g}", found.narrow, question
        )
        self._say_wish(f"Two that differ by {question.gap:g} told apart", found.apart, question)
        if found.in_mind is not None:
            self.stdout.write(f"Votes in mind: {_line(found.in_mind, question)}")

    def _say_wish(self, goal: str, wish: Wish, question: Question) -> None:
        if wish.prospect is not None:
            self.stdout.write(f"{goal}: {_line(wish.prospect, question)}")
            return
        needs = [
            f"{number} {what} would do"
            for number, what in ((wish.experts, "experts"), (wish.scenarios, "scenarios"))
            if number is not None
        ]
        self.stdout.write(
            f"{goal}: no number of votes reaches it; with every pair judged by everybody the "
            f"widest interval is ±{wish.most.widest:.0f} and {wish.most.gap:.0f} points are told "
            f"apart. {' or '.join(needs) or 'It takes more experts and scenarios'}."
        )


def _line(found: Prospect, question: Question) -> str:
    agreement = "" if found.agreement is None else f" (agreement to ±{found.agreement:.0%})"
    return (
        f"{found.votes_per_expert:,} votes per expert, {found.votes:,} in all, "
        f"{found.minutes:.0f} minutes each; intervals ±{found.half_width:.0f}, the widest "
        f"±{found.widest:.0f}; told apart from {found.gap:.0f} points on with a chance of "
        f"{question.power:.0%}; {found.judged_twice:,} pairs judged by two{agreement}."
    )
