"""A matrix of runs in a file: models x variants x options, and contestants, x scenarios x samples.

In: what a YAML file holds. Out: the contestants it stands for (found, or made), scenarios and
samples, ready to be launched; or every error with its place, and nothing kept. The other way
round, `matrix_text` writes what was chosen.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

from django.contrib.auth.models import User
from django.db import transaction
from pydantic import Field, ValidationError

from augment.errors import AugmentError, InvalidDocument, UnknownName
from augment.formats.documents import read_yaml
from augment.models import Contestant, Endpoint, EndpointModel
from augment.scene.schema import Document, problems_of
from augment.services.endpoints.contestants import LONGEST_NAME, add_contestant, ensure_builtin
from augment.services.endpoints.known_endpoints import may_hold_key
from augment.services.running.choosing import resolve_scenarios
from augment.services.scenarios.scenes import SLUG_LENGTH
from augment.variants.options import (
    MOST_SAMPLES,
    ContestantOptions,
    check_options,
    names_for,
    options_from_document,
)
from augment.variants.recipes import RECIPES, Recipe, find_recipe, spell_variant
from augment.variants.respondents import ModelRole

WHAT = "matrix"
MOST_CONTESTANTS = 500

Name = Annotated[str, Field(min_length=1, max_length=120)]


class RoleDocument(Document):
    """Who plays a role."""

    endpoint: Name
    model: Name


class ModelDocument(Document):
    """A model at an endpoint, and who plays its other roles."""

    endpoint: Name
    model: Name
    roles: dict[str, RoleDocument] = {}


class OptionsDocument(Document):
    """A set of options, for some variants alone where it says so."""

    only: list[Name] | None = None
    set: dict[str, Any] = {}


class ContestantDocument(Document):
    """A contestant by its slug; in full it is made where there is none."""

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
    models: list[ModelDocument] = []
    variants: list[Name] = []
    options: Annotated[list[OptionsDocument], Field(min_length=1)] = [OptionsDocument()]
    contestants: list[Name | ContestantDocument] = []
    scenarios: Annotated[list[Name], Field(min_length=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """What a file stands for, checked as a whole.

    Attributes:
        name: Of the job, None where the file has none.
        contestants, scenarios: Slugs, each once.
        made: Of the contestants, those that were made for it.
    """

    name: str | None
    contestants: tuple[str, ...]
    scenarios: tuple[str, ...]
    samples: int
    made: tuple[str, ...]


@transaction.atomic
def load_matrix(document: object, *, actor: User | None = None) -> Matrix:
    """The matrix that a document holds; contestants that are missing are made.

    Raises:
        InvalidDocument: With every error and its place; nothing was made.
    """
    try:
        given = MatrixDocument.model_validate(document)
    except ValidationError as fault:
        raise InvalidDocument(WHAT, problems_of(fault)) from None
    ensure_builtin()
    problems: list[tuple[str, str]] = []
    before = set(Contestant.objects.values_list("slug", flat=True))
    found = [*_product(given, problems, actor), *_named(given, problems, actor)]
    scenarios = _scenarios(given.scenarios, problems)
    if not found and not problems:
        problems.append(("models", "name models with variants, or contestants"))
    if len(found) > MOST_CONTESTANTS:
        problems.append(("models", f"{len(found)} contestants; at most {MOST_CONTESTANTS}"))
    if problems:
        raise InvalidDocument(WHAT, problems)
    slugs = tuple(dict.fromkeys(found))
    return Matrix(
        name=given.name,
        contestants=slugs,
        scenarios=scenarios,
        samples=given.samples,
        made=tuple(slug for slug in slugs if slug not in before),
    )


def read_matrix(text: str, *, actor: User | None = None) -> Matrix:
    """The matrix of a YAML file's text; contestants that are missing are made.

    Raises:
        InvalidDocument: With every error and its place; nothing was made.
    """
    return load_matrix(read_yaml(text, what=WHAT), actor=actor)


def matrix_text(
    contestants: Sequence[Contestant],
    scenarios: Sequence[str],
    *,
    samples: int = 1,
    name: str = "",
) -> str:
    """The YAML of what is chosen, to be read by `load_matrix` here or elsewhere.

    Contestants that are not stored yet are written like the others: whoever reads it makes them.
    """
    lines = ["# Read by: manage.py generate --matrix FILE", f"name: {json.dumps(name)}"]
    lines = lines if name else lines[:1]
    lines += [f"samples: {samples}", "contestants:"]
    for row in sorted(contestants, key=lambda one: one.slug):
        if row.endpoint is None:
            lines.append(f"  - {json.dumps(row.slug)}")
            continue
        whole = {
            "slug": row.slug,
            "name": row.name,
            "variant": row.variant,
            "endpoint": row.endpoint.label,
            "model": row.model,
            "roles": row.roles,
            "options": row.options,
        }
        first, *rest = [f"{key}: {json.dumps(value)}" for key, value in whole.items()]
        lines += [f"  - {first}", *(f"    {line}" for line in rest)]
    lines.append("scenarios:")
    lines += [f"  - {json.dumps(slug)}" for slug in scenarios]
    return "\n".join(lines) + "\n"


def pick_slug(wanted: ContestantDocument, options: ContestantOptions) -> str:
    """The slug of the contestant that is just so, else a free one made of what it is."""
    same = Contestant.objects.filter(
        endpoint__label=wanted.endpoint, model=wanted.model, variant=wanted.variant.lower()
    )
    for row in same.order_by("retired_at", "pk"):
        roles = {name: one.model_dump() for name, one in wanted.roles.items()}
        if (row.roles, row.options) == (roles, options.to_document()) and not row.retired_at:
            return row.slug
    parts = [wanted.model, wanted.variant, *(one.model for one in wanted.roles.values())]
    stem = re.sub(r"[^a-z0-9]+", "-", "-".join([*parts, options.slug()]).lower()).strip("-")
    stem = stem[: SLUG_LENGTH - 4].strip("-") or "contestant"
    taken = set(Contestant.objects.filter(slug__startswith=stem).values_list("slug", flat=True))
    number, slug = 1, stem
    while slug in taken:
        number += 1
        slug = f"{stem}-{number}"
    return slug


# --- Private -----------------------------------------------------------------------------------

_Problems = list[tuple[str, str]]


def _product(given: MatrixDocument, problems: _Problems, actor: User | None) -> Iterator[str]:
    """The contestants of models x variants x options."""
    if bool(given.models) != bool(given.variants):
        missing = "variants" if given.models else "models"
        problems.append((missing, "models and variants go together"))
    for place, model in enumerate(given.models):
        for column, variant in enumerate(given.variants):
            for number, options in enumerate(given.options):
                if options.only is not None and variant not in options.only:
                    continue
                where = f"models[{place}] x variants[{column}] x options[{number}]"
                whole = ContestantDocument(
                    slug="to-be-made",
                    variant=variant,
                    endpoint=model.endpoint,
                    model=model.model,
                    roles=model.roles,
                    options=options.set,
                )
                yield from _found(whole, where, problems, actor, is_named=False)


def _named(given: MatrixDocument, problems: _Problems, actor: User | None) -> Iterator[str]:
    known = set(Contestant.objects.values_list("slug", flat=True))
    for place, one in enumerate(given.contestants):
        where = f"contestants[{place}]"
        if isinstance(one, ContestantDocument):
            yield from _found(one, where, problems, actor, is_named=True)
        elif one in known:
            yield one
        else:
            problems.append((where, f"{one!r} is no contestant; write it in full to have it made"))


def _found(
    wanted: ContestantDocument,
    where: str,
    problems: _Problems,
    actor: User | None,
    *,
    is_named: bool,
) -> Iterator[str]:
    """The slug of a contestant, found or made; its errors go to the others."""
    try:
        roles = {ModelRole(role): one for role, one in wanted.roles.items()}
        options = options_from_document(wanted.options)
        check_options(find_recipe(wanted.variant), options)
        slug = wanted.slug if is_named else pick_slug(wanted, options)
        with transaction.atomic():
            made = add_contestant(
                slug=slug,
                name=wanted.name if not Contestant.objects.filter(slug=slug).exists() else None,
                variant=wanted.variant,
                endpoint=wanted.endpoint,
                model=wanted.model,
                roles={role: (one.endpoint, one.model) for role, one in roles.items()},
                options=options,
                actor=actor,
            )
    except InvalidDocument as error:
        problems += [(f"{where}.{path}", str(text)) for path, text in error.problems]
    except (AugmentError, ValueError) as error:
        problems.append((where, str(error)))
    else:
        yield made.slug


def _scenarios(names: Sequence[str], problems: _Problems) -> tuple[str, ...]:
    found: list[str] = []
    for place, name in enumerate(names):
        try:
            found += resolve_scenarios([name])
        except UnknownName as error:
            problems.append((f"scenarios[{place}]", f"{name!r} is no {error.kind}"))
    if not found and not problems:
        problems.append(("scenarios", "there is none of these"))
    return tuple(dict.fromkeys(found))


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
