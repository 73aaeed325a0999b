"""A contestant as it is entered in a form: its endpoint, known or new, and its options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict
from augment.models import Contestant, Endpoint
from augment.services.endpoints.contestants import add_contestant
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.variants.options import EFFORTS, NAMES, ToolProtocol, options_from_document
from augment.variants.recipes import RECIPES

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
