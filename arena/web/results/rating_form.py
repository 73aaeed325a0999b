"""How a new rating is asked for."""

from __future__ import annotations

from typing import Any

from django import forms

from arena.models import Snapshot
from arena.pairing.order import MAIN, REPEAT
from arena.queries.votes.judged import is_imported
from arena.queries.votes.sets import Filters
from arena.rating.leaderboard import Intervals, Method
from arena.rating.rules import Unit
from arena.services.covariates import COVARIATES, WITHOUT_PICTURES
from arena.services.ratings import DEFAULT_ROUNDS, MOST_ROUNDS
from augment.services.scenarios.scenes import type_choices

METHOD_LABELS = {"bt": "Bradley-Terry", "davidson": "Davidson (ties)", "elo": "Online Elo"}
UNIT_LABELS = {
    "": "as the votes allow",
    "two-way": "experts and scenarios",
    "scenario": "scenarios",
    "expert": "experts",
    "vote": "votes, as in the paper",
}


INTERVAL_LABELS = {
    "": "right for the method",
    "closed": "in closed form",
    "resamples": "by resamples",
}


COVARIATE_LABELS = {
    "side": "being on the left",
    "objects": "the number of objects",
    "vehicles": "the number of vehicles",
}


class AnyOf(forms.MultipleChoiceField):
    """Codes of experts; rating itself refuses those that do not occur."""

    def valid_value(self, value: Any) -> bool:
        """Whatever was ticked."""
        return True


class RatingForm(forms.Form):
    """Method, resampling and which votes count; experts are offered as a rating names them."""

    method = forms.ChoiceField(
        choices=[(one.value, METHOD_LABELS[one.value]) for one in Method],
        initial=Method.BRADLEY_TERRY.value,
        required=False,
    )
    resample = forms.ChoiceField(
        choices=[("", UNIT_LABELS[""]), *((one.value, UNIT_LABELS[one.value]) for one in Unit)],
        required=False,
    )
    intervals = forms.ChoiceField(
        choices=[
            ("", INTERVAL_LABELS[""]),
            *((interval.value, INTERVAL_LABELS[interval.value]) for interval in Intervals),
        ],
        required=False,
    )
    rounds = forms.IntegerField(
        min_value=1, max_value=MOST_ROUNDS, initial=DEFAULT_ROUNDS, required=False
    )
    seed = forms.IntegerField(min_value=0, max_value=2**63 - 1, initial=0, required=False)
    types = forms.MultipleChoiceField(choices=type_choices, required=False)
    experts = AnyOf(required=False)
    adjust = forms.MultipleChoiceField(
        choices=[(name, COVARIATE_LABELS[name]) for name in COVARIATES], required=False
    )
    with_repeats = forms.BooleanField(required=False)
    leave_out_settled = forms.BooleanField(required=False)
    leave_out_own = forms.BooleanField(required=False)

    def __init__(
        self, data: dict[str, Any] | None = None, *, snapshot: Snapshot | None = None
    ) -> None:
        super().__init__(data)
        for name in ("method", "resample", "intervals", "rounds", "seed"):
            self.fields[name].widget.attrs["class"] = "input"
        named = snapshot.results.judges if snapshot is not None else {}
        imported = snapshot is not None and is_imported(snapshot.study)
        known = WITHOUT_PICTURES if imported else COVARIATES
        self.adjustable = [(name, COVARIATE_LABELS[name]) for name in known]
        self.judges = sorted(named.items(), key=lambda item: item[1])

    def wanted(self) -> dict[str, Any]:
        """As `rate` takes it; what was not filled in is the default."""
        asked = self.cleaned_data
        kinds = (MAIN, REPEAT) if asked["with_repeats"] else (MAIN,)
        return {
            "method": asked["method"] or Method.BRADLEY_TERRY.value,
            "unit": asked["resample"] or None,
            "intervals": asked["intervals"] or None,
            "covariates": asked["adjust"],
            "rounds": asked["rounds"] or DEFAULT_ROUNDS,
            "seed": asked["seed"] or 0,
            "filters": Filters(
                types=tuple(asked["types"]),
                experts=tuple(asked["experts"]),
                kinds=kinds,
                leave_out_settled=asked["leave_out_settled"],
                leave_out_own=asked["leave_out_own"],
            ),
        }
