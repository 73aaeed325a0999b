"""The endpoints that contestants speak to. A key itself is never stored."""

from __future__ import annotations

import os

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict, UnknownName
from augment.llm.addresses import check_base_url
from augment.models import Endpoint
from augment.services.endpoints.known_endpoints import check_key_variable, log_move, move_of
from augment.services.events import log_event
from augment.services.scenarios.scenes import check_slug

OPENAI = "openai"
OPENAI_URL = "https://api.openai.com/v1"
OPENAI_KEY = "OPENAI_API_KEY"


@transaction.atomic
def ensure_endpoint(
    *,
    label: str,
    base_url: str,
    key_variable: str = "",
    is_simulated: bool = False,
    may_move_key: bool = False,
    actor: User | None = None,
) -> Endpoint:
    """The endpoint of that label, made or moved to that address.

    Args:
        label: Lower-case letters, digits and hyphens.
        base_url: Up to and including "/v1" or its like.
        key_variable: The environment variable that holds the key where the worker runs; empty
            where none is needed.
        is_simulated: Whether what it answers counts as simulated.
        may_move_key: Whether the key of an endpoint that exists may go to another server.
        actor: Who wants it.

    Raises:
        InvalidDocument: The label, the address or the variable can't be used.
        Conflict: The endpoint exists and is simulated where this one is not, or the reverse; or
            its key would go to another server, and nobody said that it may.
    """
    check_slug(label, what="endpoint")
    check_key_variable(key_variable)
    wanted = {"base_url": check_base_url(base_url), "key_variable": key_variable}
    endpoint, made = Endpoint.objects.get_or_create(
        label=label, defaults=wanted | {"is_simulated": is_simulated}
    )
    if endpoint.is_simulated != is_simulated:
        word = "simulated" if endpoint.is_simulated else "not simulated"
        raise Conflict(f"Endpoint {label!r} is {word}, and stays so; choose another label.")
    before = {"base_url": endpoint.base_url, "key_variable": endpoint.key_variable}
    move = move_of(endpoint=endpoint, base_url=wanted["base_url"], key_variable=key_variable)
    if move is not None and not may_move_key:
        raise Conflict(
            f"The key in {key_variable} of endpoint {label!r} went to {move[0]} and would go to "
            f"{move[1]}; say so with --move-key if that is meant, or choose another label."
        )
    if made or before != wanted:
        endpoint.base_url, endpoint.key_variable = wanted["base_url"], key_variable
        endpoint.save(update_fields=["base_url", "key_variable"])
        log_event(
            actor=actor,
            verb="add" if made else "change",
            object_kind="endpoint",
            object_code=endpoint.code,
            before=None if made else before,
            after={"label": label, "is_simulated": is_simulated} | wanted,
        )
        log_move(move, endpoint=endpoint, actor=actor)
    return endpoint


@transaction.atomic
def find_endpoint(label: str, actor: User | None = None) -> Endpoint:
    """The endpoint of that label; OpenAI's own appears where its key is at hand.

    Raises:
        UnknownName: There is none of that label.
        Conflict: It is OpenAI's, which was not added, and its key is not at hand.
    """
    endpoint = Endpoint.objects.filter(label=label).first()
    if endpoint is not None:
        return endpoint
    if label == OPENAI and os.environ.get(OPENAI_KEY):
        return ensure_endpoint(
            label=OPENAI, base_url=OPENAI_URL, key_variable=OPENAI_KEY, actor=actor
        )
    if label == OPENAI:
        raise Conflict(
            f"Endpoint {OPENAI!r} was not added yet: set {OPENAI_KEY} here, or name its address."
        )
    known = list(Endpoint.objects.values_list("label", flat=True))
    raise UnknownName("endpoint", label, known)
