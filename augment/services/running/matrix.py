"""What a job runs, chosen as cells of variants and models on a page, or written in a file.

A cell with a set of options is one contestant: the one that there is, else one to be made when a
job is launched. Options that a variant has no use for are left out for it. A file holds the
contestants in full, scenarios and samples: `load_matrix` reads it and makes the contestants that
are missing, or names every error with its place and keeps nothing.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

from django.contrib.auth.models import User
from django.db import transaction
from pydantic import Field, ValidationError

from augment.errors import AugmentError, InvalidDocument, UnknownName
from augment.models import Contestant, Endpoint, EndpointModel
from augment.scene.schema import Document, problems_of
from augment.services.endpoints.contestants import (
    LONGEST_NAME,
    ContestantRequest,
    add_contestant,
    ensure_builtin,
)
from augment.services.endpoints.known_endpoints import may_hold_key
from augment.services.running.choosing import resolve_scenarios
from augment.services.running.jobs import JobScope
from augment.services.scenarios.scenes import SLUG_LENGTH
from augment.variants.options import (
    MOST_SAMPLES,
    ContestantOptions,
    names_for,
    options_from_document,
)
from augment.variants.recipes import RECIPES, find_recipe, spell_variant
from augment.variants.respondents import ModelRole

WHAT = "matrix"
MOST_CONTESTANTS = 500
SEPARATOR = "|"

Name = Annotated[str, Field(min_length=1, max_length=120)]


class RoleDocument(Document):
    """Who plays a role."""

    endpoint: Name
    model: Name


class ContestantDocument(Document):
    """A contestant in full; it is made where there is none of its slug."""

    slug: Name
    name: Name | None = None
    variant: Name
    endpoint: Name
    model: Name
    roles: dict[str, RoleDocument] = {}
    options: dict[str, Any] = {}


class MatrixDocument(Document):
    """The file."""

    name: Name | None = None
    samples: Annotated[int, Field(ge=1, le=MOST_SAMPLES)] = 1
    contestants: Annotated[
        list[Name | ContestantDocument], Field(min_length=1, max_length=MOST_CONTESTANTS)
    ]
    scenarios: Annotated[list[Name], Field(min_length=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """What a file stands for, checked as a whole.

    Attributes:
        name: Of the job, empty where the file has none.
        made: The contestants that were made for it.
    """

    name: str
    scope: JobScope
    made: tuple[str, ...]


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
        """Return each cell's contestant; where there is none yet, one that is not stored."""
        return [_contestant(cell, self.options) for cell in self.cells]


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixRow:
    """A variant with every model: each cell, and why no job can run it (empty where one can)."""

    variant: str
    label: str
    cells: tuple[tuple[MatrixCell, str], ...]


def matrix_of(models: Sequence[EndpointModel]) -> list[MatrixRow]:
    """Return variants down, models across."""
    rows = []
    for recipe in RECIPES.values():
        cells = []
        for known in models:
            variable, obstacle = known.endpoint.key_variable, ""
            if variable and not may_hold_key(variable):
                obstacle = f"{variable} may not hold a key"
            elif ModelRole.VIEWER in recipe.roles and known.vision is None:
                obstacle = "nobody knows whether it sees pictures: probe it"
            elif ModelRole.VIEWER in recipe.roles and not known.vision:
                obstacle = "needs vision, and it sees text alone"
            endpoint = known.endpoint.label
            cell = MatrixCell(variant=recipe.slug, endpoint=endpoint, model=known.model)
            cells.append((cell, obstacle))
        label = spell_variant(recipe.slug)
        rows.append(MatrixRow(variant=recipe.slug, label=label, cells=tuple(cells)))
    return rows


def read_cells(keys: Sequence[str], options: Mapping[str, object]) -> ChosenCells:
    """Return the cells that a form names, with their options.

    Args:
        keys: Of cells.
        options: By name; what is missing stays open.

    Raises:
        InvalidDocument: An option can't be.
        UnknownName: There is no such variant, or no such model at that endpoint.
    """
    cells = []
    for key in dict.fromkeys(keys):
        variant, _, rest = key.partition(SEPARATOR)
        endpoint, _, model = rest.partition(SEPARATOR)
        known = EndpointModel.objects.filter(endpoint__label=endpoint)
        if not known.filter(model=model).exists():
            models = list(known.values_list("model", flat=True))
            raise UnknownName(f"model at endpoint {endpoint}", model, models)
        cell = MatrixCell(variant=find_recipe(variant).slug, endpoint=endpoint, model=model)
        cells.append(cell)
    return ChosenCells(cells=tuple(cells), options=options_from_document(options))


@transaction.atomic
def add_cells(chosen: ChosenCells, *, actor: User | None = None) -> list[str]:
    """Return the slugs of the cells' contestants; those that are missing are made.

    Raises:
        AugmentError: A contestant can't be made.
    """
    slugs = []
    for cell, row in zip(chosen.cells, chosen.contestants(), strict=True):
        if row._state.adding:
            request = ContestantRequest(
                slug=row.slug,
                variant=cell.variant,
                endpoint=cell.endpoint,
                model=cell.model,
                options=row.options,
            )
            row = add_contestant(request, actor)
        slugs.append(row.slug)
    return slugs


@transaction.atomic
def load_matrix(document: object, *, actor: User | None = None) -> Matrix:
    """Return the matrix that a document holds; contestants that are missing are made.

    Raises:
        InvalidDocument: With every error and its place; nothing was made.
    """
    try:
        given = MatrixDocument.model_validate(document)
    except ValidationError as fault:
        raise InvalidDocument(WHAT, problems_of(fault)) from None
    ensure_builtin()
    before = set(Contestant.objects.values_list("slug", flat=True))
    contestants: list[str] = []
    scenarios: list[str] = []
    problems: list[tuple[str, str]] = []
    for number, wanted in enumerate(given.contestants):
        place = f"contestants[{number}]"
        try:
            with transaction.atomic():
                contestants.append(_find_or_add(wanted, actor))
        except InvalidDocument as error:
            problems += [(f"{place}.{path}", text) for path, text in error.problems]
        except (AugmentError, ValueError) as error:
            problems.append((place, str(error)))
    for number, name in enumerate(given.scenarios):
        try:
            scenarios += resolve_scenarios([name])
        except UnknownName as error:
            problems.append((f"scenarios[{number}]", f"{name!r} is no {error.kind}"))
    if not scenarios and not problems:
        problems.append(("scenarios", "there is none of these"))
    if problems:
        raise InvalidDocument(WHAT, problems)
    slugs = tuple(dict.fromkeys(contestants))
    return Matrix(
        name=given.name or "",
        scope=JobScope(
            contestants=slugs, scenarios=tuple(dict.fromkeys(scenarios)), samples=given.samples
        ),
        made=tuple(slug for slug in slugs if slug not in before),
    )


# --- Private -----------------------------------------------------------------------------------


def _find_or_add(wanted: str | ContestantDocument, actor: User | None) -> str:
    if isinstance(wanted, str):
        if not Contestant.objects.filter(slug=wanted).exists():
            raise ValueError(f"{wanted!r} is no contestant; write it in full to have it made")
        return wanted
    is_there = Contestant.objects.filter(slug=wanted.slug).exists()
    request = ContestantRequest(
        slug=wanted.slug,
        name="" if is_there or wanted.name is None else wanted.name,
        variant=wanted.variant,
        endpoint=wanted.endpoint,
        model=wanted.model,
        roles={ModelRole(role): (one.endpoint, one.model) for role, one in wanted.roles.items()},
        options=wanted.options,
    )
    return add_contestant(request, actor).slug


def _contestant(cell: MatrixCell, options: ContestantOptions) -> Contestant:
    """Return the contestant that is just so, else a new one with a free slug, not stored."""
    usable = names_for(find_recipe(cell.variant))
    document = {name: value for name, value in options.to_document().items() if name in usable}
    alike = Contestant.objects.filter(
        endpoint__label=cell.endpoint, model=cell.model, variant=cell.variant, retired_at=None
    )
    for row in alike.select_related("endpoint").order_by("pk"):
        if not row.roles and row.options == document:
            return row
    chosen = options_from_document(document)
    parts = (cell.model, cell.variant, chosen.slug())
    stem = re.sub(r"[^a-z0-9]+", "-", "-".join(parts).lower()).strip("-")
    stem = stem[: SLUG_LENGTH - 4].strip("-") or "contestant"
    taken = set(Contestant.objects.filter(slug__startswith=stem).values_list("slug", flat=True))
    numbered = (f"{stem}-{number}" for number in range(2, len(taken) + 3))
    slug = next(one for one in (stem, *numbered) if one not in taken)
    endpoint = Endpoint.objects.get(label=cell.endpoint)
    described = chosen.describe()
    name = f"{cell.model} {spell_variant(cell.variant)}" + f" ({described})" * bool(described)
    return Contestant(
        slug=slug,
        name=name[:LONGEST_NAME],
        kind=Contestant.Kind.SIMULATED if endpoint.is_simulated else Contestant.Kind.LLM,
        variant=cell.variant,
        endpoint=endpoint,
        model=cell.model,
        options=document,
    )
