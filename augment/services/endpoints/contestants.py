"""Contestants: who is there without being added, who is added, and what they would send."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.baselines.registry import PLACERS
from augment.errors import Conflict
from augment.models import Contestant, Scenario
from augment.services.endpoints.known_endpoints import EndpointFacts, add_endpoint, find_endpoint
from augment.services.endpoints.known_models import model_at
from augment.services.endpoints.treatments import (
    Respondent,
    check_roles,
    options_of,
    other_prompts,
    respondents_of,
)
from augment.services.events import log_change
from augment.services.scenarios.prompts import preview_prompt
from augment.services.scenarios.scenes import check_slug
from augment.services.texts import one_line
from augment.variants.options import (
    EFFORTS,
    NAMES,
    ContestantOptions,
    ToolProtocol,
    check_options,
    options_from_document,
)
from augment.variants.recipes import RECIPES, Tools, find_recipe, spell_variant
from augment.variants.respondents import ModelRole
from augment.variants.showing import Shown

Kind = Contestant.Kind
LONGEST_NAME = 120

VARIANTS = tuple(RECIPES)
PROTOCOLS = tuple(protocol.value for protocol in ToolProtocol)
REASONING_EFFORTS = tuple(EFFORTS)
OPTION_NAMES = tuple(NAMES)

REFERENCE = "reference"
_BUILTIN = {REFERENCE: ("Reference", Kind.REFERENCE)} | {
    slug: (placer.name, Kind.RULE if placer.is_rule else Kind.BASELINE)
    for slug, placer in PLACERS.items()
}

Roles = Mapping[ModelRole, tuple[str | None, str]]
"""Who else plays a reviewer's role: the label of an endpoint (None: the contestant's own) and the
model id there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EnteredEndpoint:
    """Where a contestant's model is: a label alone for an endpoint that is there already."""

    label: str
    base_url: str = ""
    key_variable: str = ""
    is_simulated: bool = False


@transaction.atomic
def ensure_builtin() -> list[Contestant]:
    """Return the contestants that need no endpoint: reference, rule placer, baselines."""
    return [
        Contestant.objects.get_or_create(slug=slug, defaults={"name": name, "kind": kind})[0]
        for slug, (name, kind) in _BUILTIN.items()
    ]


@transaction.atomic
def add_contestant(
    *,
    slug: str,
    variant: str,
    endpoint: str,
    model: str,
    name: str | None = None,
    roles: Roles | None = None,
    options: ContestantOptions | None = None,
    actor: User | None = None,
) -> Contestant:
    """Add a language model that runs one variant; simulated where its endpoint is.

    The same contestant twice is one. `openai` can be named without having been added where
    OPENAI_API_KEY is set.

    Args:
        slug: Lower-case letters, digits and hyphens.
        variant: The name of a recipe, in any case.
        endpoint: The label of an endpoint.
        model: The model id on that endpoint.
        name: What people read; made from model and variant when None, and from the endpoint
            where another contestant is called so.
        roles: Who else plays a role.
        options: How it asks; what is open is fixed at its first run.
        actor: Who adds it.

    Raises:
        UnknownName: No such variant or endpoint.
        InvalidDocument: The slug, a model, a role, an option or the name can't be used.
        Conflict: The slug belongs to another contestant.
    """
    check_slug(slug, what="contestant")
    recipe = find_recipe(variant)
    check_roles(recipe, roles or {})
    chosen = options or ContestantOptions()
    check_options(recipe, chosen)
    model = one_line("model", model, what="contestant")
    own = Respondent(endpoint=find_endpoint(endpoint, actor), model=model)
    others = _reviewers(roles or {}, own, actor)
    for respondent in (own, *others.values()):
        model_at(endpoint=respondent.endpoint, model=respondent.model)
    title = _title(slug, recipe.slug, own, others, chosen) if name is None else name
    columns = _columns(title, recipe.slug, own, others, chosen)
    contestant, made = Contestant.objects.get_or_create(slug=slug, defaults=columns)
    if made:
        log_change(
            contestant,
            "add",
            actor,
            after=columns | {"slug": slug, "endpoint": own.endpoint.label},
        )
    same = [field for field in columns if field != "name" or name is not None]
    if any(getattr(contestant, field) != columns[field] for field in same):
        raise Conflict(
            f"There is another contestant called {contestant.slug!r} already: "
            f"{contestant.name} ({contestant.kind}); choose another slug."
        )
    return contestant


@transaction.atomic
def enter_contestant(
    *,
    slug: str,
    name: str,
    variant: str,
    model: str,
    endpoint: EnteredEndpoint,
    options: Mapping[str, object],
    actor: User,
) -> Contestant:
    """Add endpoint and contestant, or neither of them.

    Args:
        slug: Lower-case letters, digits and hyphens.
        name: What people read; empty to have it made from model and variant.
        variant: The name of a recipe.
        model: The model id on the endpoint.
        endpoint: Made where an address is given; one that is there is never moved.
        options: By name; what is missing stays open.
        actor: Who enters it.

    Raises:
        AugmentError: Something can't be used; the sentence says what and what is allowed.
        Conflict: There is an endpoint of that label already, and an address was given.
    """
    chosen = options_from_document(options)
    if endpoint.base_url:
        facts = EndpointFacts(base_url=endpoint.base_url, key_variable=endpoint.key_variable)
        is_simulated = endpoint.is_simulated
        add_endpoint(label=endpoint.label, facts=facts, is_simulated=is_simulated, actor=actor)
    return add_contestant(
        slug=slug,
        variant=variant,
        endpoint=endpoint.label,
        model=model,
        name=name or None,
        options=chosen,
        actor=actor,
    )


def asking_contestants() -> list[Contestant]:
    """Return the contestants that ask a model, by name; retired ones come last."""
    rows = Contestant.objects.exclude(endpoint=None).select_related("endpoint")
    return sorted(rows, key=lambda row: (row.retired_at is not None, row.name, row.pk))


def preview_contestant(scenario: Scenario, contestant: Contestant, *, role: str) -> Shown:
    """Return the first messages to a role, as the contestant's options have them.

    Options are those of its first run; of one that has not run yet, those that it would run with
    now.

    Raises:
        Conflict: It asks no model, nobody plays that role, an endpoint of it is gone, or it asks
            with prompts that are not installed any more.
        UnknownName: Its variant is none of ours any more, or there is no such role.
    """
    if not respondents_of(contestant):
        raise Conflict(f"{contestant.slug} asks no model.")
    options = options_of(contestant)
    if (unlike := other_prompts(contestant.slug, options)) is not None:
        raise Conflict(unlike)
    has_tools = find_recipe(contestant.variant).tools is not Tools.NONE
    is_native = options.protocol is ToolProtocol.NATIVE and role == ModelRole.MODIFIER
    return preview_prompt(
        scenario,
        variant=contestant.variant,
        role=role,
        native_tools=has_tools and is_native,
        options=options,
    )


def _reviewers(roles: Roles, own: Respondent, actor: User | None) -> dict[ModelRole, Respondent]:
    return {
        role: Respondent(
            endpoint=own.endpoint if label is None else find_endpoint(label, actor),
            model=one_line(f"roles.{role}", model, what="contestant"),
        )
        for role, (label, model) in sorted(roles.items())
    }


def _columns(
    name: str,
    variant: str,
    own: Respondent,
    others: Mapping[ModelRole, Respondent],
    options: ContestantOptions,
) -> dict[str, Any]:
    is_simulated = any(one.endpoint.is_simulated for one in (own, *others.values()))
    return {
        "name": one_line("name", name, what="contestant"),
        "kind": Kind.SIMULATED if is_simulated else Kind.LLM,
        "variant": variant,
        "endpoint": own.endpoint,
        "model": own.model,
        "roles": {
            role.value: {"endpoint": one.endpoint.label, "model": one.model}
            for role, one in others.items()
        },
        "options": options.to_document(),
    }


def _title(
    slug: str,
    variant: str,
    own: Respondent,
    others: Mapping[ModelRole, Respondent],
    options: ContestantOptions,
) -> str:
    """Return what people read where nobody chose a name; no other contestant's name."""
    played = (f"{role} {respondent.model}" for role, respondent in others.items())
    described = options.describe()
    parts = [own.model, spell_variant(variant), *played, *([f"({described})"] * bool(described))]
    title = " ".join(parts)[:LONGEST_NAME]
    if Contestant.objects.filter(name=title).exclude(slug=slug).exists():
        title = f"{title} at {own.endpoint.label}"[:LONGEST_NAME]
    return title
