"""A new job as it comes in by its form: cells of the matrix, contestants, scenarios, caps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from django import forms

from arena.site.forms import CapsForm, ChoiceForm, Offer
from augment.errors import AugmentError
from augment.models import Contestant, EndpointModel
from augment.services.endpoints.contestants import PROTOCOLS, REASONING_EFFORTS
from augment.services.endpoints.known_endpoints import is_key_here
from augment.services.running.choosing import find_obstacle, keys_missing
from augment.services.running.estimates import JobEstimate, estimate_rows
from augment.services.running.jobs import HIGHEST_SAMPLES
from augment.services.running.matrix import ChosenCells, MatrixCell, matrix_of, read_cells

OF_CELLS = (
    *("temperature", "seed", "reasoning_effort", "max_output_tokens"),
    *("protocol", "rounds"),
)
"""Options that the page asks for; the others are for a contestant's own page and matrix files."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedCell:
    """A box of the matrix, or why it can't be ticked."""

    cell: MatrixCell
    obstacle: str
    is_chosen: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedRow:
    """A variant with all models."""

    label: str
    cells: tuple[OfferedCell, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixColumn:
    """A model at its endpoint."""

    known: EndpointModel
    key_missing: str


class LaunchForm(ChoiceForm, CapsForm):
    """A new job."""

    contestants = forms.MultipleChoiceField(required=False)
    cells = forms.MultipleChoiceField(required=False)
    samples = forms.IntegerField(min_value=1, max_value=HIGHEST_SAMPLES, initial=1, required=False)
    is_fresh = forms.BooleanField(required=False)
    temperature = forms.FloatField(required=False, label="Temperature")
    seed = forms.IntegerField(required=False, label="Seed")
    reasoning_effort = forms.ChoiceField(
        required=False,
        choices=[("", "–"), *((word, word) for word in REASONING_EFFORTS)],
        label="Reasoning effort",
    )
    max_output_tokens = forms.IntegerField(required=False, label="Tokens of one answer, at most")
    protocol = forms.ChoiceField(
        required=False,
        choices=[("", "–"), *((word, word) for word in PROTOCOLS)],
        label="Tool protocol",
    )
    rounds = forms.IntegerField(required=False, label="Rounds, at most")

    def __init__(self, *args: Any, models: list[EndpointModel], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.models = models
        self._matrix = matrix_of(models)
        keys = [cell.key for row in self._matrix for cell, why_not in row.cells if not why_not]
        self._offer("cells", [(key, key) for key in keys])

    def clean_samples(self) -> int:
        """An empty field is one sample."""
        return self.cleaned_data["samples"] or 1

    def clean(self) -> dict[str, Any]:
        """Somebody is chosen, by name or by a cell; options are what they may be."""
        cleaned = super().clean()
        if not (cleaned.get("contestants") or cleaned.get("cells")):
            self.add_error("contestants", "Choose at least one contestant.")
        options = {name: v for name in OF_CELLS if (v := cleaned.get(name)) not in (None, "")}
        try:
            cleaned["chosen_cells"] = read_cells(cleaned.get("cells", []), options)
        except AugmentError as error:
            self.add_error(None, str(error))
        return cleaned

    @property
    def offers(self) -> list[Offer]:
        """Contestants that no job can run say why."""
        return [_offer(row) for row in self.offered]

    @property
    def columns(self) -> list[MatrixColumn]:
        """For the template: the models, and whether their keys are here."""
        return [
            MatrixColumn(known=known, key_missing="" if is_key_here(name) or not name else name)
            for known in self.models
            for name in [known.endpoint.key_variable]
        ]

    @property
    def matrix(self) -> list[OfferedRow]:
        """For the template: variants down, models across."""
        chosen = set(self.chosen("cells"))
        return [
            OfferedRow(
                label=row.label,
                cells=tuple(
                    OfferedCell(cell=cell, obstacle=why_not, is_chosen=cell.key in chosen)
                    for cell, why_not in row.cells
                ),
            )
            for row in self._matrix
        ]

    @property
    def option_fields(self) -> list[forms.BoundField]:
        """For the template."""
        return [self[name] for name in OF_CELLS]

    @property
    def has_options(self) -> bool:
        """For the template: whether any is filled in, so that one sees which."""
        return any(self[name].value() not in (None, "") for name in OF_CELLS)

    def chosen_cells_value(self) -> ChosenCells:
        """The cells with their options, once the form is valid."""
        found = self.cleaned_data.get("chosen_cells")
        return found if isinstance(found, ChosenCells) else ChosenCells()

    def chosen_rows(self) -> list[Contestant]:
        """Whoever is chosen, each once; those of cells may not be stored yet."""
        named = Contestant.objects.filter(slug__in=self.cleaned_data.get("contestants", []))
        found = [*named.select_related("endpoint"), *self.chosen_cells_value().contestants()]
        return list({row.slug: row for row in found}.values())

    def estimated(self) -> JobEstimate | None:
        """What the job would use, as far as it is chosen; nothing has to be named or capped."""
        self.is_valid()
        for name in ("name", "contestants", "scenarios"):
            self.errors.pop(name, None)
        who, scenarios = self.chosen_rows(), self.cleaned_data.get("scenarios", [])
        if not (who and scenarios):
            return None
        return estimate_rows(
            who,
            scenarios,
            samples=self.cleaned_data.get("samples", 1),
            is_fresh=self.cleaned_data.get("is_fresh", False),
        )


# --- Private -----------------------------------------------------------------------------------


def _offer(row: Contestant) -> Offer:
    why_not = find_obstacle(row)
    missing = () if why_not else tuple(keys_missing(row))
    return Offer(row=row, obstacle=why_not, keys_missing=missing)
