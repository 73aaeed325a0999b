"""Cells of the matrix of variants and models, and the contestants that they stand for.

A cell with a set of options is one contestant: the one that there is, else one to be made when a
job is launched. Options that a variant has no use for are left out for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import UnknownName
from augment.models import Contestant, Endpoint, EndpointModel
from augment.services.endpoints.contestants import LONGEST_NAME, add_contestant
from augment.services.endpoints.known_endpoints import may_hold_key
from augment.services.running.matrix import ContestantDocument, pick_slug
from augment.variants.options import ContestantOptions, names_for, options_from_document
from augment.variants.recipes import RECIPES, Recipe, find_recipe, spell_variant
from augment.variants.transcript import ModelRole

SEPARATOR = "|"


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixCell:
    """One variant with one model at one endpoint."""

    variant: str
    endpoint: str
    model: str

    @property
    def key(self) -> str:
        """What a form calls it; the model comes last, for it may hold anything."""
        return SEPARATOR.join((self.variant, self.endpoint, self.model))


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenCells:
    """Cells that somebody ticked, and how all of them ask."""

    cells: tuple[MatrixCell, ...] = ()
    options: ContestantOptions = field(default_factory=ContestantOptions)

    def contestants(self) -> list[Contestant]:
        """Each cell's contestant; where there is none yet, one that is not stored."""
        return [_contestant(cell, self.options) for cell in self.cells]


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixRow:
    """A variant with every model: each cell, and why no job can run it (empty where one can).

    Obstacles are to be said by a door in the language of whoever reads them.
    """

    variant: str
    label: str
    cells: tuple[tuple[MatrixCell, str], ...]


def matrix_of(models: Sequence[EndpointModel]) -> list[MatrixRow]:
    """Variants down, models across."""
    return [
        MatrixRow(
            variant=recipe.slug,
            label=spell_variant(recipe.slug),
            cells=tuple(
                (
                    MatrixCell(
                        variant=recipe.slug, endpoint=known.endpoint.label, model=known.model
                    ),
                    _obstacle(known, recipe),
                )
                for known in models
            ),
        )
        for recipe in RECIPES.values()
    ]


def read_cells(keys: Sequence[str], options: Mapping[str, object]) -> ChosenCells:
    """The cells that a form names, with their options.

    Args:
        keys: Of cells.
        options: By name; what is missing stays open.

    Raises:
        InvalidDocument: An option can't be.
        UnknownName: There is no such variant, or no such model at that endpoint.
    """
    return ChosenCells(
        cells=tuple(_cell(key) for key in dict.fromkeys(keys)),
        options=options_from_document(options),
    )


@transaction.atomic
def add_cells(chosen: ChosenCells, *, actor: User | None = None) -> list[str]:
    """The slugs of the cells' contestants; those that are missing are made.

    Raises:
        AugmentError: A contestant can't be made.
    """
    slugs = []
    for cell, row in zip(chosen.cells, chosen.contestants(), strict=True):
        if row._state.adding:
            row = add_contestant(
                slug=row.slug,
                variant=cell.variant,
                endpoint=cell.endpoint,
                model=cell.model,
                options=_usable(cell, chosen.options),
                actor=actor,
            )
        slugs.append(row.slug)
    return slugs


# --- Private -----------------------------------------------------------------------------------


def _document(cell: MatrixCell) -> ContestantDocument:
    return ContestantDocument(
        slug="to-be-made", variant=cell.variant, endpoint=cell.endpoint, model=cell.model
    )


def _usable(cell: MatrixCell, options: ContestantOptions) -> ContestantOptions:
    usable = names_for(find_recipe(cell.variant))
    chosen = options.to_document()
    return options_from_document({name: v for name, v in chosen.items() if name in usable})


def _cell(key: str) -> MatrixCell:
    parts = key.split(SEPARATOR, 2)
    if len(parts) != 3:
        raise UnknownName("cell", key, ["VARIANT|ENDPOINT|MODEL"])
    cell = MatrixCell(variant=find_recipe(parts[0]).slug, endpoint=parts[1], model=parts[2])
    known = EndpointModel.objects.filter(endpoint__label=cell.endpoint)
    if not known.filter(model=cell.model).exists():
        raise UnknownName(
            f"model at endpoint {cell.endpoint}",
            cell.model,
            list(known.values_list("model", flat=True)),
        )
    return cell


def _contestant(cell: MatrixCell, options: ContestantOptions) -> Contestant:
    chosen = _usable(cell, options)
    slug = pick_slug(_document(cell), chosen)
    found = Contestant.objects.filter(slug=slug).select_related("endpoint").first()
    if found is not None:
        return found
    endpoint = Endpoint.objects.get(label=cell.endpoint)
    said = chosen.describe()
    name = f"{cell.model} {spell_variant(cell.variant)}" + (f" ({said})" if said else "")
    return Contestant(
        slug=slug,
        name=name[:LONGEST_NAME],
        kind=Contestant.Kind.SIMULATED if endpoint.is_simulated else Contestant.Kind.LLM,
        variant=cell.variant,
        endpoint=endpoint,
        model=cell.model,
        options=chosen.to_document(),
    )


def _obstacle(known: EndpointModel, recipe: Recipe) -> str:
    variable = known.endpoint.key_variable
    if variable and not may_hold_key(variable):
        return f"{variable} may not hold a key"
    if ModelRole.VIEWER not in recipe.roles or known.vision:
        return ""
    if known.vision is None:
        return "nobody knows whether it sees pictures: probe it"
    return "needs vision, and it sees text alone"
