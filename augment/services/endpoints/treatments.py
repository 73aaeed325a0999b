"""What a contestant sends, fixed when it first runs: later probes and entries don't change it.

A contestant is one treatment. Were its tools called natively in one half of a study and in the
answer in the other, its rating would be that of a mixture. So what was known of its models at its
first run is kept with it, role by role, and so is the whole set of its options: what was chosen
when it was added, and what counted then of what was left open.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from django.db import transaction
from django.db.models import Exists, OuterRef

from augment.errors import Conflict, InvalidDocument, ModelFault, ParameterRefused
from augment.llm.client import ModelProfile
from augment.llm.messages import LengthName
from augment.models import Augmentation, Contestant, Endpoint, EndpointModel, ModelCall
from augment.prompts.fill import prompt_version
from augment.services.endpoints.known_models import price_of, profile_of, profiles_of
from augment.services.events import log_event
from augment.variants.options import (
    NAMES,
    ContestantOptions,
    complete_options,
    options_from_document,
)
from augment.variants.recipes import Recipe, find_recipe
from augment.variants.respondents import ModelRole


@dataclass(frozen=True, slots=True, kw_only=True)
class Respondent:
    """A model at an endpoint."""

    endpoint: Endpoint
    model: str

    def __str__(self) -> str:
        return f"{self.model} at {self.endpoint.label}"

    @property
    def known(self) -> EndpointModel | None:
        """What is known of the model there, None where nobody entered anything."""
        return EndpointModel.objects.filter(endpoint=self.endpoint, model=self.model).first()

    @property
    def context_tokens(self) -> int | None:
        """The model's context window there, None where nobody entered it."""
        return self.known.context_tokens if self.known else None


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


def respondents_of(contestant: Contestant) -> dict[ModelRole, Respondent]:
    """Who plays each role of a contestant's variant; nobody where it has none.

    Raises:
        UnknownName: Its variant is none of ours any more.
        Conflict: An endpoint that it names is gone.
    """
    return respondents_of_each([contestant])[contestant.pk]


def respondents_of_each(
    contestants: Sequence[Contestant],
) -> dict[int, dict[ModelRole, Respondent]]:
    """The same of several, by primary key; one query at most where their endpoints are read.

    Raises:
        UnknownName: The variant of one is none of ours any more.
        Conflict: An endpoint that one names is gone.
    """
    labels = {role["endpoint"] for row in contestants for role in row.roles.values()}
    rows = Endpoint.objects.filter(label__in=labels) if labels else ()
    endpoints = {row.label: row for row in rows}
    return {row.pk: _respondents(row, endpoints) for row in contestants}


def documents_of(respondents: Mapping[ModelRole, Respondent]) -> dict[str, dict[str, str]]:
    """The respondents as they are stored with a contestant."""
    return {
        role.value: {"endpoint": respondent.endpoint.label, "model": respondent.model}
        for role, respondent in sorted(respondents.items())
    }


def viewer_of(contestant: Contestant) -> Respondent | None:
    """Who looks at pictures for a contestant, None where its variant shows none."""
    return respondents_of(contestant).get(ModelRole.VIEWER)


def sight_of(respondent: Respondent) -> bool | None:
    """Whether a model sees pictures, None where nobody probed it or said so."""
    known = respondent.known
    return None if known is None else known.vision


# --- Private -----------------------------------------------------------------------------------


def _respondents(
    contestant: Contestant, endpoints: Mapping[str, Endpoint]
) -> dict[ModelRole, Respondent]:
    if contestant.endpoint is None:
        return {}
    own = Respondent(endpoint=contestant.endpoint, model=contestant.model)
    respondents = dict.fromkeys(find_recipe(contestant.variant).roles, own)
    for name, chosen in contestant.roles.items():
        endpoint = endpoints.get(chosen["endpoint"])
        if endpoint is None:
            raise Conflict(
                f"The {name} of {contestant.slug} sits at endpoint '{chosen['endpoint']}', "
                "which does not exist any more."
            )
        respondents[ModelRole(name)] = Respondent(endpoint=endpoint, model=chosen["model"])
    return respondents


OPTIONS = NAMES
"""Of a contestant, in the order in which they are shown."""

_REFUSABLE = frozenset({"temperature", "seed", "reasoning_effort"})
_SENT = _REFUSABLE | frozenset(LengthName)
"""Parameters that some endpoints refuse and that contestants send."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Treatment:
    """What a contestant sends in each of its roles, and its options, none of ours left open."""

    contestant_pk: int
    respondents: Mapping[ModelRole, Respondent]
    profiles: Mapping[ModelRole, ModelProfile]
    options: ContestantOptions

    def at(self, endpoint: Endpoint) -> dict[str, ModelProfile]:
        """By model, what it sends to an endpoint."""
        return {
            respondent.model: self.profiles[role]
            for role, respondent in self.respondents.items()
            if respondent.endpoint.pk == endpoint.pk
        }

    def without(
        self, refused: ParameterRefused, *, endpoint: Endpoint, model: str
    ) -> ModelProfile:
        """What it sends from now on to a model that does not take one parameter.

        Raises:
            ModelFault: Earlier answers of this contestant were made with the parameter.
        """
        roles = [
            role
            for role, respondent in self.respondents.items()
            if (respondent.endpoint.pk, respondent.model) == (endpoint.pk, model)
        ]
        # Whether the limit of the answer's length has the one name or the other changes nothing.
        is_only_a_name = refused.parameter in frozenset(LengthName)
        if not is_only_a_name and _answered_with(self.contestant_pk, roles, refused.parameter):
            raise ModelFault(
                f"{model} at endpoint {endpoint.label} does not take {refused.parameter!r} any "
                "more, and this contestant's earlier answers were made with it; add another "
                "contestant for what can be sent now",
                retryable=False,
                status=refused.status,
            ) from None
        return _amend(self.contestant_pk, roles, refused.parameter)


@transaction.atomic
def treatment_of(contestant: Contestant, respondents: Mapping[ModelRole, Respondent]) -> Treatment:
    """What a contestant sends; roles that never ran are fixed to what is known now.

    Args:
        contestant: Who is about to run.
        respondents: Who plays its roles.

    Raises:
        Conflict: It ran with prompts that are not installed any more, or is told to.
    """
    columns = Contestant.objects.values_list("sends", "frozen_options").get(pk=contestant.pk)
    stored, frozen = columns[0] or {}, columns[1]
    if frozen is None or any(role.value not in stored for role in respondents):
        row = Contestant.objects.select_for_update(no_key=True).get(pk=contestant.pk)
        stored = dict(row.sends or {})
        new = {
            role.value: document_of(
                profile_of(endpoint=respondent.endpoint, model=respondent.model)
            )
            for role, respondent in respondents.items()
            if role.value not in stored
        }
        row.sends = stored = stored | new
        row.frozen_options = frozen = row.frozen_options or _completed(row).to_document()
        row.save(update_fields=["sends", "frozen_options"])
        log_event(
            actor=None,
            verb="fix",
            object_kind="contestant",
            object_code=row.code,
            after={"slug": row.slug, "sends": new, "options": frozen},
        )
    options = options_from_document(frozen)
    unlike = other_prompts(contestant.slug, options)
    if unlike is not None:
        raise Conflict(unlike)
    return Treatment(
        contestant_pk=contestant.pk,
        respondents=respondents,
        profiles={role: profile_from_document(stored[role.value]) for role in respondents},
        options=options,
    )


def options_of(contestant: Contestant) -> ContestantOptions:
    """The options of a contestant: fixed at its first run, before that as they would be now."""
    if contestant.frozen_options is not None:
        return options_from_document(contestant.frozen_options)
    if contestant.endpoint is None:
        return ContestantOptions()
    return _completed(contestant)


def other_prompts(slug: str, options: ContestantOptions) -> str | None:
    """What to say of options that name prompts which are not installed; None where they are."""
    wanted, installed = options.prompt_version, prompt_version()
    if wanted is None or wanted == installed:
        return None
    return (
        f"{slug} asks with prompts of version {wanted}, and version {installed} is installed. "
        "Add another contestant like it, which asks with the installed ones"
    )


def left_out(contestant: Contestant) -> dict[str, list[str]]:
    """By role, the chosen options that its model does not take and that are not sent therefore.

    Of a contestant that has not run yet: as far as it is known now.

    Raises:
        Conflict: An endpoint that it names is gone.
    """
    return left_out_of_each([contestant])[contestant.pk]


def left_out_of_each(contestants: Sequence[Contestant]) -> dict[int, dict[str, list[str]]]:
    """The same of several, by primary key, in two queries at most.

    Raises:
        Conflict: An endpoint that one of them names is gone.
    """
    # Never of what is completed at the first run: no default of ours is one of these.
    chosen = {
        row.pk: _REFUSABLE & (row.frozen_options or row.options).keys() for row in contestants
    }
    open_rows = [row for row in contestants if chosen[row.pk] and not row.sends]
    playing = respondents_of_each(open_rows)
    known = profiles_of(
        [respondent for roles in playing.values() for respondent in roles.values()]
    )
    found: dict[int, dict[str, list[str]]] = {}
    for row in contestants:
        sends = row.sends or {
            role.value: document_of(known[one.endpoint.pk, one.model])
            for role, one in playing.get(row.pk, {}).items()
        }
        refused = {
            role: sorted(chosen[row.pk] & set(sent["refused"]))
            for role, sent in sorted(sends.items())
        }
        found[row.pk] = {role: names for role, names in refused.items() if names}
    return found


def loosen_unanswered(contestants: Iterable[Contestant]) -> int:
    """Let contestants be fixed anew that never had an answer and do not run: nothing can mix.

    Returns:
        How many there were.
    """
    pks = [contestant.pk for contestant in contestants]
    calls = ModelCall.objects.filter(
        attempt__augmentation__contestant=OuterRef("pk"), answer__isnull=False
    )
    running = Augmentation.objects.filter(
        contestant=OuterRef("pk"), state=Augmentation.State.RUNNING
    )
    loose = Contestant.objects.filter(pk__in=pks, sends__isnull=False)
    return (
        loose.exclude(Exists(calls))
        .exclude(Exists(running))
        .update(sends=None, frozen_options=None)
    )


def document_of(profile: ModelProfile) -> dict[str, Any]:
    """What of a profile changes what contestants send, ready for JSON.

    No variant sends a schema, so what is known of it is not among it.
    """
    refused = profile.refused | ({"temperature"} if profile.temperature is False else set())
    return {
        "native_tools": profile.native_tools,
        "vision": profile.vision,
        "refused": sorted(refused & _SENT),
        "reasoning_effort": profile.reasoning_effort,
        "max_output_tokens": profile.max_output_tokens,
    }


def profile_from_document(document: Mapping[str, Any]) -> ModelProfile:
    """The profile that was stored as this document.

    Raises:
        KeyError: It is none.
    """
    refused = frozenset(document["refused"])
    return ModelProfile(
        native_tools=document["native_tools"],
        vision=document["vision"],
        temperature=False if "temperature" in refused else None,
        refused=refused - {"temperature"},
        reasoning_effort=document["reasoning_effort"],
        max_output_tokens=document["max_output_tokens"],
    )


# --- Private -----------------------------------------------------------------------------------


def _completed(contestant: Contestant) -> ContestantOptions:
    """What was chosen, and for the rest what counts now."""
    recipe, modifier = find_recipe(contestant.variant), (contestant.sends or {}).get("modifier")
    if modifier is None:
        assert contestant.endpoint is not None
        known = profile_of(endpoint=contestant.endpoint, model=contestant.model)
        modifier = document_of(known)
    return complete_options(
        options_from_document(contestant.options),
        recipe,
        native_tools=modifier["native_tools"],
        prompt_version=prompt_version(),
    )


def _answered_with(contestant_pk: int, roles: list[ModelRole], parameter: str) -> bool:
    """Whether the contestant has an answer to a request that had this parameter."""
    calls = ModelCall.objects.filter(
        attempt__augmentation__contestant=contestant_pk,
        role__in=roles,
        answer__isnull=False,
        request__has_key=parameter,
    )
    return calls.exists()


@transaction.atomic
def _amend(contestant_pk: int, roles: list[ModelRole], parameter: str) -> ModelProfile:
    """Leave a parameter out of what is sent in these roles; what is sent then."""
    row = Contestant.objects.select_for_update(no_key=True).get(pk=contestant_pk)
    sends = dict(row.sends or {})
    after = ModelProfile()
    for role in roles:
        after = profile_from_document(sends[role.value]).without(parameter)
        sends[role.value] = document_of(after)
    if sends != row.sends:
        row.sends = sends
        row.save(update_fields=["sends"])
    return after


def list_unpriced_models(contestants: Iterable[Contestant]) -> list[str]:
    """What the contestants ask models whose price is unknown, as "model at endpoint"."""
    unpriced = {
        str(respondent)
        for row in contestants
        for respondent in respondents_of(row).values()
        if price_of(respondent.endpoint, respondent.model) is None
    }
    return sorted(unpriced)
