"""Who plays which role of a contestant: by default its own model plays them all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from augment.errors import Conflict, InvalidDocument
from augment.models import Contestant, Endpoint, EndpointModel
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
