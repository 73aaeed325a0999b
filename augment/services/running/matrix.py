"""The matrix of variants x models on the page of a new job.

A cell with a set of options is one contestant: the one that there is, else one to be made when a
job is launched. Options that a variant has no use for are left out for it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db import transaction

from augment.models import Contestant, Endpoint, EndpointModel
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import find_key_obstacle
from augment.variants.options import ContestantOptions, names_for, options_from_document
from augment.variants.recipes import RECIPES, Recipe, find_recipe, spell_variant
from augment.variants.respondents import ModelRole

SEPARATOR = "|"


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixCell:
    """One variant with one model at one endpoint.

    Attributes:
        key: What a form calls it; the model comes last, for it may hold anything.
        obstacle: Why no job can run it, empty where one can.
    """

    key: str
    endpoint: str
    model: str
    obstacle: str


def make_matrix(models: Sequence[EndpointModel]) -> dict[str, list[MatrixCell]]:
    """Return by variant, as people read it, a cell for each model."""
    return {
        spell_variant(recipe.slug): [_cell(recipe, model) for model in models]
        for recipe in RECIPES.values()
    }


def find_cells(keys: Sequence[str], options: Mapping[str, object]) -> list[Contestant]:
    """Return each cell's contestant; where there is none yet, one that is not stored.

    Args:
        keys: Of cells that a form offered.
        options: How all of them ask, by name; what is missing stays open.

    Raises:
        InvalidDocument: An option can't be.
    """
    chosen = options_from_document(options)
    return [_contestant(key, chosen) for key in dict.fromkeys(keys)]


@transaction.atomic
def add_cells(rows: Sequence[Contestant], *, actor: User | None = None) -> list[str]:
    """Return the slugs of the cells' contestants; those that are missing are made.

    Raises:
        AugmentError: A contestant can't be made.
    """
    for row in rows:
        if row._state.adding:
            assert row.endpoint is not None
            request = contestants.ContestantRequest(
                slug=row.slug,
                variant=row.variant,
                endpoint=row.endpoint.label,
                model=row.model,
                options=row.options,
            )
            contestants.add_contestant(request, actor)
    return [row.slug for row in rows]


# --- Private -----------------------------------------------------------------------------------


def _cell(recipe: Recipe, model: EndpointModel) -> MatrixCell:
    endpoint = model.endpoint
    obstacle = find_key_obstacle(endpoint.key_variable, endpoint.base_url)
    if not obstacle and ModelRole.VIEWER in recipe.roles and not model.vision:
        obstacle = "needs vision, and it sees text alone"
        if model.vision is None:
            obstacle = "nobody knows whether it sees pictures: probe it"
    key = SEPARATOR.join((recipe.slug, endpoint.label, model.model))
    return MatrixCell(key=key, endpoint=endpoint.label, model=model.model, obstacle=obstacle)


def _contestant(key: str, options: ContestantOptions) -> Contestant:
    """Return the contestant that is just so, else a new one with a free slug, not stored."""
    variant, label, model = key.split(SEPARATOR, 2)
    usable = names_for(find_recipe(variant))
    document = {name: value for name, value in options.to_document().items() if name in usable}
    alike = Contestant.objects.filter(
        endpoint__label=label, model=model, variant=variant, retired_at=None
    )
    for row in alike.select_related("endpoint").order_by("pk"):
        if not row.roles and row.options == document:
            return row
    chosen = options_from_document(document)
    endpoint = Endpoint.objects.get(label=label)
    return Contestant(
        slug=contestants.contestant_slug(model, variant, document),
        name=f"{model} {spell_variant(variant)} {chosen.describe()}".strip()[
            : contestants.LONGEST_NAME
        ],
        kind=Contestant.Kind.SIMULATED if endpoint.is_simulated else Contestant.Kind.LLM,
        variant=variant,
        endpoint=endpoint,
        model=model,
        options=document,
    )
