"""manage.py plan_study: how many votes a study needs, and what they will tell."""

from __future__ import annotations

from typing import Any

from django.core.management.base import CommandError, CommandParser

from arena.models import Study
from arena.rating.prospects import Outlook, Prospect, Question, Wish, foretell
from arena.rating.sample_size import StudyDesign
from arena.services.prospects import GUESSES, known_of, usual_seconds
from augment.errors import AugmentError
from augment.services.terminal import TerminalCommand

HELP = {
    "contestants": "how many are compared",
    "experts": "how many judge",
    "scenarios": "how many are shown",
    "spread": "Elo points from the worst to the best",
    "ties": "percent of the votes that say Equal",
    "expert_sd": "Elo points by which experts differ about a contestant",
    "scenario_sd": "Elo points by which scenarios differ in a contestant",
    "half_width": "Elo points expected of the widest 95 %% interval",
    "gap": "Elo points between two that are to be told apart",
    "power": "percent, the chance of that",
    "seconds": "of one vote",
    "repeats": "hidden repeats, percent on top of the votes",
    "checks": "attention checks, percent on top of the votes",
    "overlap": "percent of the judged pairs that two experts judge",
}
_WHOLE = ("contestants", "experts", "scenarios")


class Command(TerminalCommand):
    """The door to arena.rating.prospects."""

    help = "Work out the votes of a study before there is one; needs nothing in the database."

    def add_arguments(self, parser: CommandParser) -> None:
        """The design; whatever is left open is taken from the study, else guessed."""
        parser.add_argument("--like", metavar="STUDY", help="name of a study to take numbers from")
        for name, text in HELP.items():
            parser.add_argument(
                f"--{name.replace('_', '-')}",
                type=int if name in _WHOLE else float,
                metavar="N",
                help=f"{text} (guess: {GUESSES[name]})",
            )
        parser.add_argument("--votes-per-expert", type=int, metavar="N", help="in mind")

    def handle(self, *args: Any, **options: Any) -> None:
        """Say what it takes."""
        given = {name: options[name] for name in HELP if options[name] is not None}
        known = self._known(options["like"])
        values = GUESSES | known | given
        try:
            question = _question(values, options["votes_per_expert"])
        except ValueError as error:
            raise CommandError(str(error)) from error
        for name, value in values.items():
            origin = "given" if name in given else "known" if name in known else "guessed"
            self.stdout.write(f"{name.replace('_', ' ')}: {value:g} ({origin})")
        self._say(question, foretell(question))

    def _known(self, name: str | None) -> dict[str, Any]:
        if name is None:
            seconds = usual_seconds()
            return {} if seconds is None else {"seconds": seconds}
        study = Study.objects.filter(name=name).first()
        if study is None:
            raise CommandError(f"There is no study named {name!r}.")
        try:
            return known_of(study).values
        except AugmentError as error:
            raise CommandError(str(error)) from error

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


def _question(values: dict[str, Any], votes_per_expert: int | None) -> Question:
    for name in ("half_width", "gap", "seconds"):
        if not values[name] > 0:
            raise ValueError(f"{name} must be more than 0, not {values[name]}")
    if not 50 <= values["power"] < 100:
        raise ValueError(f"power goes from 50 to below 100, not {values['power']}")
    for name in ("repeats", "checks"):
        if not 0 <= values[name] <= 50:
            raise ValueError(f"{name} go from 0 to 50, not {values[name]}")
    if votes_per_expert is not None and votes_per_expert < 1:
        raise ValueError(f"votes per expert must be 1 or more, not {votes_per_expert}")
    return Question(
        design=StudyDesign(
            **{name: values[name] for name in (*_WHOLE, "spread", "expert_sd", "scenario_sd")},
            tie_share=values["ties"] / 100,
            overlap_share=values["overlap"] / 100,
        ),
        half_width=values["half_width"],
        gap=values["gap"],
        power=values["power"] / 100,
        votes_per_expert=votes_per_expert,
        seconds=values["seconds"],
        extra_share=(values["repeats"] + values["checks"]) / 100,
    )


def _line(found: Prospect, question: Question) -> str:
    agreement = "" if found.agreement is None else f" (agreement to ±{found.agreement:.0%})"
    return (
        f"{found.votes_per_expert:,} votes per expert, {found.votes:,} in all, "
        f"{found.minutes:.0f} minutes each; intervals ±{found.half_width:.0f}, the widest "
        f"±{found.widest:.0f}; told apart from {found.gap:.0f} points on with a chance of "
        f"{question.power:.0%}; {found.judged_twice:,} pairs judged by two{agreement}."
    )
