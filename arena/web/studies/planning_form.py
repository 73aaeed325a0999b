"""What somebody enters who plans a study, parsed once."""

from __future__ import annotations

from typing import Any

from django import forms

from arena.services.study_estimate import ESTIMATE_INPUTS, StudyEstimate
from arena.site.forms import form_field

WHO = ("contestants", "experts", "scenarios")
EXPECTED = ("spread", "ties", "expert_sd", "scenario_sd", "seconds")
WANTED = ("half_width", "gap", "power", "votes_per_expert")
ON_TOP = ("repeats", "checks", "overlap")


class PlanningForm(forms.Form):
    """A study that somebody thinks of, and what it is to tell; shares in percent."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.fields |= {one.name: form_field(one) for one in ESTIMATE_INPUTS}

    def rows_of(self, names: tuple[str, ...]) -> list[forms.BoundField]:
        """For the template."""
        return [self[name] for name in names]

    def clean(self) -> dict[str, Any]:
        """So many ties must go together with so large a spread."""
        cleaned = super().clean() or {}
        if self.errors:
            return cleaned
        possible = StudyEstimate(**cleaned).most_ties
        if cleaned["ties"] >= possible:
            self.add_error(
                "ties", f"Contestants so far apart can tie in less than {possible:.0f} % of votes."
            )
        return cleaned
