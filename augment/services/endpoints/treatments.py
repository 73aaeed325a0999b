"""Models of a contestant's roles and their requests, fixed when it first runs.

By default a contestant's own model plays all roles. A contestant is one treatment: were its tools
called natively in one half of a study and in the answer in the other, its rating would be that of
a mixture. So what was known of its models at its first run is kept with it, role by role, and so
is the whole set of its options: what was chosen when it was added, and the defaults of then.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from django.db import transaction
from django.db.models import Exists, OuterRef

from augment.errors import Conflict, InvalidDocument, ModelFault, ParameterRefused
from augment.llm.client import ModelProfile
from augment.llm.messages import LengthName, SchemaForm
from augment.models import Augmentation, Contestant, Endpoint, EndpointModel, ModelCall
from augment.prompts.fill import prompt_version
from augment.services.endpoints.known_models import find_price, read_facts, read_profile
from augment.services.events import log_change
from augment.variants.options import ContestantOptions, complete_options, options_from_document
from augment.variants.recipes import Recipe, find_recipe
from augment.variants.respondents import ModelRole

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Treatment:
    """Requests of a contestant in each of its roles, and its options, defaults filled in."""

    contestant_pk: int
    respondents: Mapping[ModelRole, Respondent]
    profiles: Mapping[ModelRole, ModelProfile]
    options: ContestantOptions

    def at(self, endpoint: Endpoint) -> dict[str, ModelProfile]:
        """Return by model what it sends to an endpoint."""
        return {
            respondent.model: self.profiles[role]
            for role, respondent in self.respondents.items()
            if respondent.endpoint.pk == endpoint.pk
        }

    @transaction.atomic
    def without(
        self, refused: ParameterRefused, *, endpoint: Endpoint, model: str
    ) -> ModelProfile:
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
        if parameter not in frozenset(LengthName) and answers.exists():
            raise ModelFault(
                f"{model} at endpoint {endpoint.label} does not take {parameter!r} any "
                "more, and this contestant's earlier answers were made with it; add another "
                "contestant for what can be sent now",
                retryable=False,
                status=refused.status,
            ) from None
        row = Contestant.objects.select_for_update(no_key=True).get(pk=self.contestant_pk)
        sends, profile = dict(row.sends or {}), ModelProfile()
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
    return sorted(
        str(respondent) for respondent in respondents if find_price(respondent.facts) is None
    )


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
        role.value: _profile_document(
            read_profile(endpoint=respondent.endpoint, model=respondent.model)
        )
        for role, respondent in read_respondents(contestant).items()
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


@transaction.atomic
def _fix(
    contestant: Contestant, respondents: Mapping[ModelRole, Respondent]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fix what was left open of a contestant's roles and options; return both."""
    row = Contestant.objects.select_for_update(no_key=True).get(pk=contestant.pk)
    before = row.sends or {}
    new = {
        role.value: _profile_document(
            read_profile(endpoint=respondent.endpoint, model=respondent.model)
        )
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
        profile = read_profile(endpoint=contestant.endpoint, model=contestant.model)
        modifier = _profile_document(profile)
    return complete_options(
        options_from_document(contestant.options),
        find_recipe(contestant.variant),
        native_tools=modifier["native_tools"],
        prompt_version=prompt_version(),
    )


def _profile_document(profile: ModelProfile) -> dict[str, Any]:
    """Return the part of a profile that changes requests."""
    sent = SAMPLING | frozenset(LengthName) | frozenset(SchemaForm)
    return asdict(profile) | {"refused": sorted(profile.refused & sent)}


def _parse_profile(document: Mapping[str, Any]) -> ModelProfile:
    return ModelProfile(**{**document, "refused": frozenset(document["refused"])})
