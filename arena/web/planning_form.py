"""What somebody enters who plans a study, parsed once."""

from __future__ import annotations

from typing import Any

from django import forms

from arena.rating.prospects import Question
from arena.rating.sample_size import StudyDesign
from arena.services.prospects import GUESSES

LABELS = {
    "contestants": "Contestants",
    "experts": "Experts",
    "scenarios": "Scenarios",
    "spread": "From the worst to the best, Elo points",
    "ties": "Votes that say Equal, %",
    "expert_sd": "Experts differ about a contestant by, Elo points",
    "scenario_sd": "Scenarios differ in a contestant by, Elo points",
    "half_width": "Expected widest interval ±, Elo points",
    "gap": "Tell two apart that differ by, Elo points",
    "power": "with a chance of, %",
    "seconds": "Seconds for one vote",
    "repeats": "Hidden repeats, %",
    "checks": "Attention checks, %",
    "overlap": "Pairs that two experts judge, %",
    "votes_per_expert": "Votes per expert in mind",
}
WHO = ("contestants", "experts", "scenarios")
EXPECTED = ("spread", "ties", "expert_sd", "scenario_sd", "seconds")
WANTED = ("half_width", "gap", "power", "votes_per_expert")
ON_TOP = ("repeats", "checks", "overlap")


def _whole(name: str, least: int, most: int, *, required: bool = True) -> forms.IntegerField:
    return forms.IntegerField(
        min_value=least, max_value=most, required=required, label=LABELS[name]
    )


def _number(name: str, least: float, most: float) -> forms.FloatField:
    return forms.FloatField(min_value=least, max_value=most, label=LABELS[name])


class PlanningForm(forms.Form):
    """A study that somebody thinks of, and what it is to tell; shares in percent."""

    contestants = _whole("contestants", 2, 500)
    experts = _whole("experts", 2, 500)
    scenarios = _whole("scenarios", 2, 10_000)
    spread = _number("spread", 0, 3000)
    ties = _number("ties", 0, 99)
    expert_sd = _number("expert_sd", 0, 1000)
    scenario_sd = _number("scenario_sd", 0, 1000)
    seconds = _number("seconds", 0.1, 3600)
    half_width = _number("half_width", 1, 1000)
    gap = _number("gap", 1, 2000)
    power = _number("power", 50, 99.9)
    votes_per_expert = _whole("votes_per_expert", 1, 10_000, required=False)
    repeats = _number("repeats", 0, 50)
    checks = _number("checks", 0, 50)
    overlap = _number("overlap", 0, 80)

    def rows_of(self, names: tuple[str, ...]) -> list[forms.BoundField]:
        """For the template."""
        return [self[name] for name in names]

    def clean(self) -> dict[str, Any]:
        """So many ties must go together with so large a spread."""
        cleaned = super().clean() or {}
        if self.errors:
            return cleaned
        possible = 100 * design_of(cleaned | {"ties": 0}).most_ties
        if cleaned["ties"] >= possible:
            self.add_error(
                "ties",
                f"Contestants so far apart can tie in less than {possible:.0f} % of votes.",
            )
        return cleaned

    def question(self) -> Question:
        """What is asked, once the form is valid."""
        return question_of(self.cleaned_data)


def design_of(entered: dict[str, Any]) -> StudyDesign:
    """The design of what was entered, by the names of the fields."""
    return StudyDesign(
        **{name: entered[name] for name in (*WHO, "spread", "expert_sd", "scenario_sd")},
        tie_share=entered["ties"] / 100,
        overlap_share=entered["overlap"] / 100,
    )


def question_of(entered: dict[str, Any]) -> Question:
    """The question of what was entered, by the names of the fields."""
    return Question(
        design=design_of(entered),
        half_width=entered["half_width"],
        gap=entered["gap"],
        power=entered["power"] / 100,
        votes_per_expert=entered.get("votes_per_expert"),
        seconds=entered["seconds"],
        extra_share=(entered["repeats"] + entered["checks"]) / 100,
    )


def filled_in(known: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    """Guesses, overridden by what is known, overridden by what somebody gave."""
    return GUESSES | known | {name: value for name, value in given.items() if value is not None}
