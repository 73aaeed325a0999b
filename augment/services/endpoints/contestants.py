"""Contestants: who is there without being added, who is added, and what they would send."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.baselines.registry import PLACERS
from augment.errors import Conflict
from augment.models import Contestant, EndpointModel
from augment.services.endpoints.known_endpoints import find_endpoint
from augment.services.endpoints.known_models import model_at
from augment.services.endpoints.treatments import Respondent, check_roles
from augment.services.events import log_change
from augment.services.inputs import Input, InputKind, input_field
from augment.services.slugs import SLUG_RULE, check_slug, free_slug
from augment.services.texts import one_line
from augment.variants.options import RULES, ContestantOptions, check_options, options_from_document
from augment.variants.recipes import RECIPES, Recipe, find_recipe, spell_variant
from augment.variants.respondents import ModelRole

Kind = Contestant.Kind
LONGEST_NAME = 120

VARIANTS = tuple(RECIPES)

REFERENCE = "reference"
BUILTIN = {REFERENCE: ("Reference", Kind.REFERENCE)} | {
    slug: (placer.name, Kind.RULE if placer.is_rule else Kind.BASELINE)
    for slug, placer in PLACERS.items()
}

_OPTION_KINDS = {int: InputKind.WHOLE, float: InputKind.NUMBER}

Roles = Mapping[ModelRole, tuple[str | None, str]]
"""Who else plays a reviewer's role: the label of an endpoint (None: the contestant's own) and the
model id there."""

OPTION_INPUTS = tuple(
    Input(
        name=name,
        kind=_OPTION_KINDS.get(rule.kind, InputKind.CHOICE if rule.choices else InputKind.TEXT),
        label=rule.label,
        least=rule.least,
        most=rule.most,
        choices={word: word for word in rule.choices},
        default=None,
    )
    for name, rule in RULES.items()
)
"""The options of a contestant; what is not given stays open."""


@dataclass(frozen=True, kw_only=True)
class ContestantRequest:
    """A new contestant that asks a language model.

    Attributes:
        options: How it asks, by name; what is open is fixed at its first run.
        roles: Who else plays a role.
    """

    slug: str = input_field(InputKind.TEXT, "Slug", SLUG_RULE, default="", most=80)
    name: str = input_field(
        InputKind.TEXT, "Name", "Empty: made of model and variant.", default="", most=LONGEST_NAME
    )
    variant: str = input_field(
        InputKind.CHOICE,
        "Variant",
        "FC has the paper’s function, a pose on a lane; FC-plus ours, with what lies around it.",
        choices={
            name: f"{spell_variant(name)}: {recipe.title}" for name, recipe in RECIPES.items()
        },
    )
    endpoint: str = input_field(InputKind.TEXT, "Label of an endpoint", most=80)
    model: str = input_field(InputKind.TEXT, "Model id on the endpoint", most=120)
    options: Mapping[str, Any] = field(default_factory=dict)
    roles: Roles = field(default_factory=dict)


@transaction.atomic
def ensure_builtin() -> list[Contestant]:
    """Return the contestants that need no endpoint: reference, rule placer, baselines."""
    return [
        Contestant.objects.get_or_create(slug=slug, defaults={"name": name, "kind": kind})[0]
        for slug, (name, kind) in BUILTIN.items()
    ]


@transaction.atomic
def add_contestant(request: ContestantRequest, actor: User | None = None) -> Contestant:
    """Add a language model that runs one variant; simulated where its endpoint is.

    The same contestant twice is one. `openai` can be named without having been added where
    OPENAI_API_KEY is set.

    Raises:
        UnknownName: No such variant or endpoint.
        InvalidDocument: The slug, a model, a role, an option or the name can't be used.
        Conflict: The slug belongs to another contestant.
    """
    slug = request.slug or contestant_slug(request.model, request.variant, request.options)
    check_slug(slug, what="contestant")
    recipe = find_recipe(request.variant)
    check_roles(recipe, request.roles)
    options = options_from_document(request.options)
    check_options(recipe, options)
    model = one_line("model", request.model, what="contestant")
    own = Respondent(endpoint=find_endpoint(request.endpoint, actor), model=model)
    others = _reviewers(request.roles, own, actor)
    for respondent in (own, *others.values()):
        model_at(endpoint=respondent.endpoint, model=respondent.model)
    title = request.name or _title(slug, recipe, options, own, others)
    is_simulated = any(respondent.endpoint.is_simulated for respondent in (own, *others.values()))
    columns: dict[str, Any] = {
        "name": one_line("name", title, what="contestant"),
        "kind": Kind.SIMULATED if is_simulated else Kind.LLM,
        "variant": recipe.slug,
        "endpoint": own.endpoint,
        "model": own.model,
        "roles": {
            role.value: {"endpoint": respondent.endpoint.label, "model": respondent.model}
            for role, respondent in others.items()
        },
        "options": options.to_document(),
    }
    row, made = Contestant.objects.get_or_create(slug=slug, defaults=columns)
    if made:
        log_change(
            row, "add", actor, after=columns | {"slug": row.slug, "endpoint": own.endpoint.label}
        )
    same = columns.keys() - ({"name"} if not request.name else set())
    if any(getattr(row, name) != columns[name] for name in same):
        raise Conflict(
            f"There is another contestant called {row.slug!r} already: {row.name} ({row.kind}); "
            "choose another slug."
        )
    return row


def paper_variants(model: EndpointModel) -> tuple[str, ...]:
    """Return the paper's variants that a model can play, as far as its probe shows."""
    return ("otm", "fc", "tqa", *(["vqa"] if model.vision else []))


def contestant_slug(model: str, variant: str, options: Mapping[str, Any]) -> str:
    """Return a slug that says how a contestant asks and that nobody has."""
    words = "-".join((model, variant, options_from_document(options).slug()))
    return free_slug(Contestant.objects, words, otherwise="contestant")


def _reviewers(roles: Roles, own: Respondent, actor: User | None) -> dict[ModelRole, Respondent]:
    return {
        role: Respondent(
            endpoint=own.endpoint if label is None else find_endpoint(label, actor),
            model=one_line(f"roles.{role}", model, what="contestant"),
        )
        for role, (label, model) in sorted(roles.items())
    }


def _title(
    slug: str,
    recipe: Recipe,
    options: ContestantOptions,
    own: Respondent,
    others: Mapping[ModelRole, Respondent],
) -> str:
    """Return the default title; no other contestant has it."""
    played = [f"{role} {respondent.model}" for role, respondent in others.items()]
    parts = [own.model, spell_variant(recipe.slug), *played]
    if described := options.describe():
        parts.append(f"({described})")
    title = " ".join(parts)[:LONGEST_NAME]
    if Contestant.objects.filter(name=title).exclude(slug=slug).exists():
        title = f"{title} at {own.endpoint.label}"[:LONGEST_NAME]
    return title
