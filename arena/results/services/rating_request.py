"""Request for a new rating, shared by form, API and services."""

from collections.abc import Sequence
from dataclasses import dataclass

from arena.models import Question
from arena.pairing.order import MAIN, REPEAT
from arena.rating.leaderboard import Intervals, Method
from arena.rating.rules import FEWEST_DRAWS, METHOD_TEXTS, MOST_DRAWS, UNIT_TEXTS
from arena.results.queries.votes import Filters
from arena.results.services.ratings import Choices
from arena.studies.services.plan import HIGHEST_SEED
from augment.services import InputKind, input_field
from augment.services.scenarios import types_named

INTERVALS = {
    Intervals.BOOTSTRAP.value: "by bootstrap",
    Intervals.CLOSED_FORM.value: "in closed form",
    Intervals.RESAMPLES.value: "by resamples of single votes",
}


@dataclass(frozen=True, kw_only=True)
class RatingRequest:
    """A new rating of a study's votes as they are now."""

    method: str = input_field(
        InputKind.CHOICE, "Method", choices=METHOD_TEXTS, default=Method.BRADLEY_TERRY.value
    )
    resample: str | None = input_field(
        InputKind.CHOICE,
        "Votes clustered by",
        "As the votes allow unless given.",
        choices=UNIT_TEXTS,
        default=None,
    )
    intervals: str | None = input_field(
        InputKind.CHOICE,
        "Intervals",
        "As preregistered, or right for the method, unless given.",
        choices=INTERVALS,
        default=None,
    )
    rounds: int | None = input_field(
        InputKind.WHOLE,
        "Rounds",
        "As many as the intervals need unless given.",
        least=FEWEST_DRAWS,
        most=MOST_DRAWS,
        default=None,
    )
    seed: int = input_field(InputKind.WHOLE, "Seed", least=0, most=HIGHEST_SEED, default=0)
    question: str | None = input_field(
        InputKind.CHOICE,
        "Question",
        "One that the study asks; its primary one unless given.",
        choices=dict(Question.choices),
        default=None,
    )
    types: Sequence[str] = input_field(InputKind.NAMES, "Scenario types", default=())
    experts: Sequence[str] = input_field(
        InputKind.NAMES, "Experts", "Codes as a rating names them; none for all.", default=()
    )
    with_repeats: bool = input_field(InputKind.SWITCH, "Count hidden repeats too", default=False)
    leave_out_settled: bool = input_field(
        InputKind.SWITCH,
        "Leave out pairs that nobody can tell apart, instead of counting them as ties",
        default=False,
    )
    leave_out_own: bool = input_field(
        InputKind.SWITCH, "Leave out votes of authors on their own contestants", default=False
    )

    def choices(self) -> Choices:
        """Return it as the rating services take it.

        Raises:
            UnknownName: There is no such scenario type.
        """
        return Choices(
            method=self.method,
            unit=self.resample,
            intervals=self.intervals,
            rounds=self.rounds,
            seed=self.seed,
            filters=Filters(
                types=types_named(self.types),
                experts=tuple(self.experts),
                kinds=(MAIN, REPEAT) if self.with_repeats else (MAIN,),
                leave_out_settled=self.leave_out_settled,
                leave_out_own=self.leave_out_own,
                question=self.question or "",
            ),
        )
