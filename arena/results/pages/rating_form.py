"""How a new rating is asked for, and rating at once or by a worker."""

from functools import partial
from typing import Any, Unpack

from django import forms
from django.contrib import messages
from django.db import transaction
from django.http import HttpRequest

from arena import tasks
from arena.models import Snapshot, Study
from arena.pairing.order import MAIN, REPEAT
from arena.rating.leaderboard import Intervals, Method
from arena.rating.rules import Unit
from arena.results.pages.tabs import COVARIATE_LABELS
from arena.results.queries.votes import Filters, is_imported
from arena.results.services.covariates import COVARIATES, WITHOUT_PICTURES
from arena.results.services.ratings import (
    DEFAULT_ROUNDS,
    MOST_ROUNDS,
    Choices,
    is_big,
    plan_snapshot,
    rate_now,
)
from augment.services.scenarios.scenes import type_choices

METHODS = {
    Method.BRADLEY_TERRY: "Bradley-Terry",
    Method.DAVIDSON: "Davidson (ties)",
    Method.ELO: "Online Elo",
}
UNITS = {
    "": "as the votes allow",
    Unit.TWO_WAY: "experts and scenarios",
    Unit.SCENARIO: "scenarios",
    Unit.EXPERT: "experts",
    Unit.VOTE: "votes, as in the paper",
}
INTERVALS = {
    "": "right for the method",
    Intervals.CLOSED_FORM: "in closed form",
    Intervals.RESAMPLES: "by resamples",
}


class AnyOf(forms.MultipleChoiceField):
    """Codes of experts; rating itself refuses those that do not occur."""

    def valid_value(self, value: Any) -> bool:
        """Whatever was ticked."""
        return True


class RatingForm(forms.Form):
    """Method, resampling and which votes count; experts are offered as a rating names them."""

    method = forms.ChoiceField(choices=[*METHODS.items()], required=False)
    resample = forms.ChoiceField(choices=[*UNITS.items()], required=False)
    intervals = forms.ChoiceField(choices=[*INTERVALS.items()], required=False)
    rounds = forms.IntegerField(
        min_value=1, max_value=MOST_ROUNDS, initial=DEFAULT_ROUNDS, required=False
    )
    seed = forms.IntegerField(min_value=0, max_value=2**63 - 1, initial=0, required=False)
    types = forms.MultipleChoiceField(choices=type_choices, required=False)
    experts = AnyOf(required=False)
    adjust = forms.MultipleChoiceField(choices=[*COVARIATE_LABELS.items()], required=False)
    with_repeats = forms.BooleanField(required=False)
    leave_out_settled = forms.BooleanField(required=False)
    leave_out_own = forms.BooleanField(required=False)

    def __init__(
        self, data: dict[str, Any] | None = None, *, snapshot: Snapshot | None = None
    ) -> None:
        super().__init__(data)
        for name in ("method", "resample", "intervals", "rounds", "seed"):
            self.fields[name].widget.attrs["class"] = "input"
        names = snapshot.results.judges if snapshot is not None else {}
        imported = snapshot is not None and is_imported(snapshot.study)
        known = WITHOUT_PICTURES if imported else COVARIATES
        self.adjustable = [(name, COVARIATE_LABELS[name]) for name in known]
        self.judges = sorted(names.items(), key=lambda item: item[1])

    def choices(self) -> Choices:
        """As `rate_now` takes it; what was not filled in is the default."""
        asked = self.cleaned_data
        return Choices(
            method=asked["method"] or Method.BRADLEY_TERRY.value,
            unit=asked["resample"] or None,
            intervals=asked["intervals"] or None,
            covariates=asked["adjust"],
            rounds=asked["rounds"] or DEFAULT_ROUNDS,
            seed=asked["seed"] or 0,
            filters=Filters(
                types=tuple(asked["types"]),
                experts=tuple(asked["experts"]),
                kinds=(MAIN, REPEAT) if asked["with_repeats"] else (MAIN,),
                leave_out_settled=asked["leave_out_settled"],
                leave_out_own=asked["leave_out_own"],
            ),
        )


def rate_or_send(request: HttpRequest, study: Study, **choices: Unpack[Choices]) -> None:
    """Rate a study's current votes; with many of them a worker does, and a message says so.

    Raises:
        ArenaError, AugmentError: Those of `plan_snapshot`; QueueFault where no worker is reached.
    """
    if not is_big(study):
        rate_now(study=study, **choices)
        return
    with transaction.atomic():
        planned = plan_snapshot(study=study, **choices)
        transaction.on_commit(partial(tasks.send_snapshot, planned.pk))
    messages.success(request, "The rating is being computed.")
