"""Contestants: who is there, who is added, and what each sends, fixed when it first runs.

By default a contestant's own model plays all roles. A contestant is one treatment: were its tools
called natively in one half of a study and in the answer in the other, its rating would be that of
a mixture. So what was known of its models at its first run is kept with it, role by role, and so
is the whole set of its options: what was chosen when it was added, and the defaults of then.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Exists, OuterRef

from augment.baselines.registry import PLACERS
from augment.errors import Conflict, InvalidDocument, ModelFault, ParameterRefused
from augment.llm import client, costs, messages
from augment.models import Augmentation, Contestant, Endpoint, EndpointModel, ModelCall
from augment.prompts.fill import prompt_version
from augment.services.endpoints.known_endpoints import find_endpoint
from augment.services.endpoints.known_models import find_price, model_at, read_facts, read_profile
from augment.services.events import log_change
from augment.services.inputs import Input, InputKind, input_field
from augment.services.texts import SLUG_RULE, check_slug, free_slug, one_line
from augment.variants.options import (
    RULES,
    ContestantOptions,
    check_options,
    complete_options,
    options_from_document,
)
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


# --- Treatments --------------------------------------------------------------------------------

SAMPLING = frozenset({"temperature", "seed", "reasoning_effort"})
"""Options that some endpoints refuse."""


@dataclass(frozen=True, kw_only=True)
class Respondent:
    """A model at an endpoint that plays a role."""

    endpoint: Endpoint
    model: str

    def __str__(self) -> str:
        return f"{self.model} at {self.endpoint.label}"

    @cached_property
    def facts(self) -> EndpointModel:
        """Facts about the model there; read once."""
        return read_facts(endpoint=self.endpoint, model=self.model)

    @property
    def price(self) -> costs.Price | None:
        """Price of the model there, None where it is unknown."""
        return find_price(self.facts)

    @property
    def sends(self) -> dict[str, Any]:
        """Part of what is known of the model now that changes requests."""
        return _profile_document(read_profile(self.facts))


@dataclass(frozen=True, slots=True, kw_only=True)
class Treatment:
    """Requests of a contestant in each of its roles, and its options, defaults filled in."""

    contestant_pk: int
    respondents: Mapping[ModelRole, Respondent]
    profiles: Mapping[ModelRole, client.ModelProfile]
    options: ContestantOptions

    def at(self, endpoint: Endpoint) -> dict[str, client.ModelProfile]:
        """Return by model what it sends to an endpoint."""
        return {
            respondent.model: self.profiles[role]
            for role, respondent in self.respondents.items()
            if respondent.endpoint.pk == endpoint.pk
        }

    @transaction.atomic
    def without(
        self, refused: ParameterRefused, *, endpoint: Endpoint, model: str
    ) -> client.ModelProfile:
        """Return the profile from now on of a model that refuses one parameter.

        Raises:
            ModelFault: Earlier answers of this contestant were made with the parameter.
        """
        parameter = refused.parameter
        respondent_asked = Respondent(endpoint=endpoint, model=model)
        roles = [
            role for role, respondent in self.respondents.items() if respondent == respondent_asked
        ]
        answers = ModelCall.objects.filter(
            attempt__augmentation__contestant=self.contestant_pk,
            role__in=roles,
            answer__isnull=False,
            request__has_key=parameter,
        )
        # Whether the limit of the answer's length has the one name or the other changes nothing.
        if parameter not in frozenset(messages.LengthName) and answers.exists():
            raise ModelFault(
                f"{model} at endpoint {endpoint.label} does not take {parameter!r} any "
                "more, and this contestant's earlier answers were made with it; add another "
                "contestant for what can be sent now",
                retryable=False,
                status=refused.status,
            ) from None
        row = Contestant.objects.select_for_update(no_key=True).get(pk=self.contestant_pk)
        sends, profile = dict(row.sends or {}), client.ModelProfile()
        for role in roles:
            profile = _parse_profile(sends[role.value]).without(parameter)
            sends[role.value] = _profile_document(profile)
        if sends != row.sends:
            row.sends = sends
            row.save(update_fields=["sends"])
        return profile


def read_treatment(
    contestant: Contestant, respondents: Mapping[ModelRole, Respondent]
) -> Treatment:
    """Return a contestant's requests; roles that never ran are fixed to today's facts.

    Args:
        contestant: Who is about to run, as just read.
        respondents: Who plays its roles.

    Raises:
        Conflict: It ran with prompts that are not installed any more, or is told to.
    """
    stored, frozen = contestant.sends or {}, contestant.frozen_options
    if frozen is None or any(role.value not in stored for role in respondents):
        stored, frozen = _fix(contestant, respondents)
    options = options_from_document(frozen)
    if (unlike := other_prompts(contestant.slug, options)) is not None:
        raise Conflict(unlike)
    return Treatment(
        contestant_pk=contestant.pk,
        respondents=respondents,
        profiles={role: _parse_profile(stored[role.value]) for role in respondents},
        options=options,
    )


def check_roles(recipe: Recipe, roles: Iterable[ModelRole]) -> None:
    """Refuse roles that nobody plays in a recipe, and the modifier's, which is the contestant's.

    Raises:
        InvalidDocument: One is named.
    """
    free = [role for role in recipe.roles if role is not ModelRole.MODIFIER]
    allowed = f"{recipe.slug} has {', '.join(free) or 'no role besides the modifier'}"
    problems = [(f"roles.{role}", allowed) for role in roles if role not in free]
    if problems:
        raise InvalidDocument("contestant", problems)


def read_respondents(contestant: Contestant) -> dict[ModelRole, Respondent]:
    """Return who plays each role of a contestant's variant; nobody where it has none.

    Raises:
        UnknownName: Its variant is none of ours any more.
        Conflict: An endpoint that it names is gone.
    """
    if contestant.endpoint is None:
        return {}
    own = Respondent(endpoint=contestant.endpoint, model=contestant.model)
    roles = dict.fromkeys(find_recipe(contestant.variant).roles, own)
    for name, chosen in contestant.roles.items():
        endpoint = Endpoint.objects.filter(label=chosen["endpoint"]).first()
        if endpoint is None:
            raise Conflict(
                f"The {name} of {contestant.slug} sits at endpoint '{chosen['endpoint']}', "
                "which does not exist any more."
            )
        roles[ModelRole(name)] = Respondent(endpoint=endpoint, model=chosen["model"])
    return roles


def list_unpriced_models(contestants: Iterable[Contestant]) -> list[str]:
    """Return the models without a price that contestants ask, as "model at endpoint"."""
    respondents = {
        respondent for row in contestants for respondent in read_respondents(row).values()
    }
    return sorted(str(respondent) for respondent in respondents if respondent.price is None)


def read_options(contestant: Contestant) -> ContestantOptions:
    """Return the options fixed at a contestant's first run, before that as they would be now."""
    if contestant.frozen_options is not None:
        return options_from_document(contestant.frozen_options)
    return _complete_options(contestant) if contestant.endpoint else ContestantOptions()


def other_prompts(slug: str, options: ContestantOptions) -> str | None:
    """Return why the prompts of options are not installed; None if they are."""
    wanted, installed = options.prompt_version, prompt_version()
    if wanted is None or wanted == installed:
        return None
    return (
        f"{slug} asks with prompts of version {wanted}, and version {installed} is installed. "
        "Add another contestant like it, which asks with the installed ones"
    )


def list_unsent_options(contestant: Contestant) -> dict[str, list[str]]:
    """Return by role the chosen options that are not sent, as its model does not take them.

    Of a contestant that has not run yet: as far as it is known now.

    Raises:
        Conflict: An endpoint that it names is gone.
    """
    # Never of what is completed at the first run: no default of ours is one of these.
    chosen = SAMPLING & (contestant.frozen_options or contestant.options).keys()
    if not chosen:
        return {}
    sends = contestant.sends or {
        role.value: respondent.sends for role, respondent in read_respondents(contestant).items()
    }
    refused = {role: sorted(chosen & set(sent["refused"])) for role, sent in sends.items()}
    return {role: names for role, names in sorted(refused.items()) if names}


def loosen_unanswered(contestants: Iterable[Contestant]) -> None:
    """Let contestants be fixed anew that never had an answer and do not run: nothing can mix."""
    answers = ModelCall.objects.filter(
        attempt__augmentation__contestant=OuterRef("pk"), answer__isnull=False
    )
    running = Augmentation.objects.filter(
        contestant=OuterRef("pk"), state=Augmentation.State.RUNNING
    )
    fixed = Contestant.objects.filter(
        pk__in=[contestant.pk for contestant in contestants], sends__isnull=False
    )
    loose = fixed.exclude(Exists(answers)).exclude(Exists(running))
    loose.update(sends=None, frozen_options=None)


# --- Private -----------------------------------------------------------------------------------


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


@transaction.atomic
def _fix(
    contestant: Contestant, respondents: Mapping[ModelRole, Respondent]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fix what was left open of a contestant's roles and options; return both."""
    row = Contestant.objects.select_for_update(no_key=True).get(pk=contestant.pk)
    before = row.sends or {}
    new = {
        role.value: respondent.sends
        for role, respondent in respondents.items()
        if role.value not in before
    }
    row.sends = before | new
    row.frozen_options = row.frozen_options or _complete_options(row).to_document()
    row.save(update_fields=["sends", "frozen_options"])
    log_change(row, "fix", after={"slug": row.slug, "sends": new, "options": row.frozen_options})
    return row.sends, row.frozen_options


def _complete_options(contestant: Contestant) -> ContestantOptions:
    """Return the options with today's defaults for open ones."""
    modifier = (contestant.sends or {}).get("modifier")
    if modifier is None:
        assert contestant.endpoint is not None
        modifier = Respondent(endpoint=contestant.endpoint, model=contestant.model).sends
    return complete_options(
        options_from_document(contestant.options),
        find_recipe(contestant.variant),
        native_tools=modifier["native_tools"],
        prompt_version=prompt_version(),
    )


def _profile_document(profile: client.ModelProfile) -> dict[str, Any]:
    """Return the part of a profile that changes requests."""
    sent = SAMPLING | frozenset(messages.LengthName) | frozenset(messages.SchemaForm)
    return asdict(profile) | {"refused": sorted(profile.refused & sent)}


def _parse_profile(document: Mapping[str, Any]) -> client.ModelProfile:
    return client.ModelProfile(**{**document, "refused": frozenset(document["refused"])})
