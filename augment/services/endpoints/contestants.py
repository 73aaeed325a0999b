"""Contestants: who is there without being added, who is added, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db import transaction

from augment.baselines.registry import PLACERS
from augment.errors import Conflict, UnknownName
from augment.models import Contestant, Endpoint, Scenario
from augment.services.endpoints.known_endpoints import ensure_endpoint, find_endpoint
from augment.services.endpoints.known_models import model_at
from augment.services.endpoints.treatments import (
    Respondent,
    check_roles,
    documents_of,
    options_of,
    other_prompts,
    respondents_of,
)
from augment.services.events import log_event
from augment.services.scenarios.prompts import Preview, preview_prompt
from augment.services.scenarios.scenes import check_slug
from augment.services.texts import one_line
from augment.variants.options import (
    EFFORTS,
    NAMES,
    ContestantOptions,
    ToolProtocol,
    check_options,
    names_for,
    options_from_document,
)
from augment.variants.recipes import RECIPES, Recipe, Tools, find_recipe, spell_variant
from augment.variants.respondents import ModelRole

Kind = Contestant.Kind
LONGEST_NAME = 120

REFERENCE = "reference"
_BUILTIN = {REFERENCE: ("Reference", Kind.REFERENCE)} | {
    slug: (placer.name, Kind.RULE if placer.is_rule else Kind.BASELINE)
    for slug, placer in PLACERS.items()
}


@transaction.atomic
def ensure_builtin() -> list[Contestant]:
    """The contestants that need no endpoint: the reference, the rule placer, the baselines."""
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
    roles: Mapping[ModelRole, tuple[str | None, str]] | None = None,
    options: ContestantOptions | None = None,
    spoken: ContestantOptions | None = None,
    actor: User | None = None,
) -> Contestant:
    """A language model that runs one variant; a simulated one where the endpoint is simulated.

    The same contestant twice is one. What the model can do and costs has a row of its own, made
    empty here where there is none; `openai` can be named without having been added where
    OPENAI_API_KEY is set.

    Args:
        slug: Lower-case letters, digits and hyphens.
        variant: The name of a recipe, in any case.
        endpoint: The label of an endpoint.
        model: The model id on that endpoint.
        name: What people read; made from model and variant when None, and from the endpoint
            where another contestant is called so.
        roles: Who else plays a reviewer's role: the label of an endpoint (None: the contestant's
            own) and the model id there.
        options: How it asks; what is open is fixed at its first run.
        spoken: Those of the options that a name made here tells; None for all.
        actor: Who adds it.

    Raises:
        UnknownName: No such variant or endpoint.
        InvalidDocument: The slug, a model, a role, an option or the name can't be used.
        Conflict: The slug belongs to another contestant.
    """
    check_slug(slug, what="contestant")
    recipe = find_recipe(variant)
    address = find_endpoint(endpoint, actor)
    model = one_line("model", model, what="contestant")
    others = _respondents(recipe, roles or {}, address, actor)
    respondents = (Respondent(endpoint=address, model=model), *others.values())
    chosen = options or ContestantOptions()
    check_options(recipe, chosen)
    told = chosen if spoken is None else spoken
    title = _title(slug, model, recipe, others, address, told) if name is None else name
    simulated = any(respondent.endpoint.is_simulated for respondent in respondents)
    wanted = {
        "name": one_line("name", title, what="contestant"),
        "kind": Kind.SIMULATED if simulated else Kind.LLM,
        "variant": recipe.slug,
        "endpoint": address,
        "model": model,
        "roles": documents_of(others),
        "options": chosen.to_document(),
    }
    for respondent in respondents:
        model_at(endpoint=respondent.endpoint, model=respondent.model)
    return _stored(slug, wanted, named=name is not None, actor=actor)


@transaction.atomic
def add_like(
    *,
    slug: str,
    like: str,
    changes: Mapping[str, str] | None = None,
    name: str | None = None,
    roles: Mapping[ModelRole, tuple[str | None, str]] | None = None,
    options: ContestantOptions | None = None,
    actor: User | None = None,
) -> Contestant:
    """A contestant as another one, but for what is given; it asks with the installed prompts.

    What the other one ran with counts, be it a default of then; options that another variant has
    no use for stay behind. A name made here tells only what somebody chose.

    Args:
        slug: Of the new one.
        like: Of the one that is followed.
        changes: Its variant, endpoint or model, where these are to be others.
        name: What people read.
        roles: Who else plays a role, beside those of the one that is followed.
        options: What it chooses otherwise.
        actor: Who adds it.

    Raises:
        UnknownName: No such contestant, variant or endpoint.
        InvalidDocument: Something can't be used.
        Conflict: The one that is followed asks no model, or the slug is another one's.
    """
    row = Contestant.objects.select_related("endpoint").filter(slug=like).first()
    if row is None:
        raise UnknownName(
            "contestant", like, list(Contestant.objects.values_list("slug", flat=True))
        )
    if row.endpoint is None:
        raise Conflict(f"{like} asks no language model; there is nothing to be like.")
    before = {"variant": row.variant, "endpoint": row.endpoint.label, "model": row.model}
    kept = {ModelRole(role): (one["endpoint"], one["model"]) for role, one in row.roles.items()}
    wanted = before | dict(changes or {})
    usable = set(names_for(find_recipe(wanted["variant"]))) - {"prompt_version"}
    asked = (options or ContestantOptions()).to_document()
    chosen, ran = (
        options_from_document({k: v for k, v in copied.items() if k in usable} | asked)
        for copied in (row.options, (row.frozen_options or {}) | row.options)
    )
    return add_contestant(
        slug=slug,
        **wanted,
        name=name,
        roles=kept | dict(roles or {}),
        options=ran,
        spoken=chosen,
        actor=actor,
    )


# --- Private -----------------------------------------------------------------------------------


def _title(
    slug: str,
    model: str,
    recipe: Recipe,
    others: Mapping[ModelRole, Respondent],
    own: Endpoint,
    options: ContestantOptions,
) -> str:
    """What people read where nobody chose a name; not what another contestant is called."""
    given = (f"{role} {respondent.model}" for role, respondent in others.items())
    said = options.describe()
    parts = [model, spell_variant(recipe.slug), *given, *([f"({said})"] if said else [])]
    title = " ".join(parts)[:LONGEST_NAME]
    if Contestant.objects.filter(name=title).exclude(slug=slug).exists():
        title = f"{title} at {own.label}"[:LONGEST_NAME]
    return title


def _log_added(contestant: Contestant, actor: User | None) -> None:
    facts = ("slug", "name", "kind", "variant", "model", "roles", "options")
    assert contestant.endpoint is not None
    log_event(
        actor=actor,
        verb="add",
        object_kind="contestant",
        object_code=contestant.code,
        after={name: getattr(contestant, name) for name in facts}
        | {"endpoint": contestant.endpoint.label},
    )


def _respondents(
    recipe: Recipe,
    roles: Mapping[ModelRole, tuple[str | None, str]],
    own: Endpoint,
    actor: User | None,
) -> dict[ModelRole, Respondent]:
    """Who plays the roles that were given away."""
    check_roles(recipe, roles)
    return {
        role: Respondent(
            endpoint=own if label is None else find_endpoint(label, actor),
            model=one_line(f"roles.{role}", model, what="contestant"),
        )
        for role, (label, model) in sorted(roles.items())
    }


def _stored(
    slug: str, wanted: dict[str, object], *, named: bool, actor: User | None
) -> Contestant:
    """The contestant of that slug, made where there is none.

    Raises:
        Conflict: The slug stands for another one.
    """
    contestant, made = Contestant.objects.get_or_create(slug=slug, defaults=wanted)
    if made:
        _log_added(contestant, actor)
    else:
        _refuse_another(contestant, wanted, named=named)
    return contestant


def _refuse_another(contestant: Contestant, wanted: dict[str, object], *, named: bool) -> None:
    """Raise Conflict where the slug stands for something else."""
    facts = [field for field in wanted if field != "name" or named]
    if any(getattr(contestant, field) != wanted[field] for field in facts):
        raise Conflict(
            f"There is another contestant called {contestant.slug!r} already: "
            f"{contestant.name} ({contestant.kind}); choose another slug."
        )


VARIANTS = tuple(RECIPES)
PROTOCOLS = tuple(protocol.value for protocol in ToolProtocol)
REASONING_EFFORTS = tuple(EFFORTS)
OPTION_NAMES = tuple(NAMES)


@dataclass(frozen=True, slots=True, kw_only=True)
class EnteredEndpoint:
    """Where its model is: a label alone for an endpoint that is there already."""

    label: str
    base_url: str = ""
    key_variable: str = ""
    is_simulated: bool = False


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
    """Endpoint and contestant, or neither of them.

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
        _refuse_known(endpoint.label)
        ensure_endpoint(
            label=endpoint.label,
            base_url=endpoint.base_url,
            key_variable=endpoint.key_variable,
            is_simulated=endpoint.is_simulated,
            actor=actor,
        )
    return add_contestant(
        slug=slug,
        variant=variant,
        endpoint=endpoint.label,
        model=model,
        name=name or None,
        options=chosen,
        actor=actor,
    )


# --- Private -----------------------------------------------------------------------------------


def _refuse_known(label: str) -> None:
    """Raise Conflict where an endpoint is called so: others ask it at the address it has."""
    if Endpoint.objects.filter(label=label).exists():
        raise Conflict(
            f"There is an endpoint “{label}” already. Choose it from the list, or give the "
            "new one another label."
        )


def asking_contestants() -> list[Contestant]:
    """Those that ask a model, by name; who is retired comes last."""
    rows = Contestant.objects.exclude(endpoint=None).select_related("endpoint")
    return sorted(rows, key=lambda row: (row.retired_at is not None, row.name, row.pk))


def preview_contestant(scenario: Scenario, contestant: Contestant, *, role: str) -> Preview:
    """The first messages to a role, as the contestant's options have them.

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
    calls = find_recipe(contestant.variant).tools is not Tools.NONE
    is_native = options.protocol is ToolProtocol.NATIVE
    return preview_prompt(
        scenario,
        variant=contestant.variant,
        role=role,
        native_tools=calls and is_native and role == ModelRole.MODIFIER,
        options=options,
    )
