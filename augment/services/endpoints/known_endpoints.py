"""The endpoints that contestants speak to. A key itself is never stored."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from datetime import date
from decimal import Decimal
from typing import Any
from urllib.parse import urlsplit

from django.conf import settings
from django.contrib.auth.models import User
from django.core.exceptions import ValidationError
from django.db import models, transaction

from augment.errors import Conflict, InvalidDocument, KeyMissing, KeyNotAllowed, UnknownName
from augment.llm.addresses import check_base_url
from augment.models import Endpoint, EndpointModel
from augment.services.endpoints.known_models import facts_of, model_at
from augment.services.events import log_event
from augment.services.scenarios.scenes import check_slug
from augment.services.texts import one_line

_A_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")
_FOR_KEYS = re.compile(r"[A-Za-z_][A-Za-z0-9_]*_API_KEY")

RULE = "a variable whose name ends in _API_KEY, or one that ARENA_KEY_VARIABLES lists"


def may_hold_key(variable: str) -> bool:
    """Whether an endpoint may be sent what this variable holds."""
    return bool(_FOR_KEYS.fullmatch(variable)) or variable in settings.KEY_VARIABLES


def check_key_variable(variable: str) -> None:
    """Nothing for a variable that an endpoint may name, or for none.

    Raises:
        InvalidDocument: It is no name, or not meant for keys. What is no name is not repeated,
            because it may be the key itself.
    """
    if not variable:
        return
    problem = ""
    if not _A_NAME.fullmatch(variable):
        problem = "the name of an environment variable is needed, not the key"
    elif not may_hold_key(variable):
        problem = (
            f"{variable} may not be sent to an endpoint: a variable whose name ends in _API_KEY, "
            "or one that ARENA_KEY_VARIABLES lists is needed"
        )
    if problem:
        raise InvalidDocument("endpoint", [("key_variable", problem)])


def is_key_here(variable: str) -> bool:
    """Whether this process has the key; workers elsewhere may have it all the same."""
    return bool(os.environ.get(variable, "").strip())


def list_key_variables() -> list[str]:
    """Names, and only names, of the variables that may hold a key and are set or listed here."""
    here = {name for name in os.environ if _FOR_KEYS.fullmatch(name)}
    return sorted(here | set(settings.KEY_VARIABLES))


def move_of(*, endpoint: Endpoint, base_url: str, key_variable: str) -> tuple[str, str] | None:
    """Where an endpoint's key went so far and would go, None where it goes on to the same server.

    Args:
        endpoint: As it is stored.
        base_url: As it is to be.
        key_variable: As it is to be.
    """
    before, after = _server(endpoint.base_url), _server(base_url)
    has_key = bool(endpoint.key_variable and key_variable)
    return (before, after) if has_key and before != after else None


def log_move(move: tuple[str, str] | None, *, endpoint: Endpoint, actor: User | None) -> None:
    """Note that a key goes elsewhere from now on; nothing where it does not."""
    if move is not None:
        log_event(
            actor=actor,
            verb="move key",
            object_kind="endpoint",
            object_code=endpoint.code,
            before={"server": move[0]},
            after={"server": move[1], "key_variable": endpoint.key_variable},
        )


def key_of(endpoint: Endpoint) -> str | None:
    """The endpoint's key, read from the environment at the moment of the call.

    Raises:
        KeyNotAllowed: The variable is not meant for keys, whoever wrote it into the row.
        KeyMissing: The variable is not set; the sentence names it.
    """
    variable = endpoint.key_variable
    if not variable:
        return None
    if not may_hold_key(variable):
        raise KeyNotAllowed(variable, endpoint.label, RULE)
    key = os.environ.get(variable, "").strip()
    if not key:
        raise KeyMissing(variable, endpoint.label)
    return key


# --- Private -----------------------------------------------------------------------------------


def _server(base_url: str) -> str:
    """Scheme, host and port: a key sent without encryption goes elsewhere, too."""
    parts = urlsplit(base_url)
    scheme = parts.scheme.lower()
    port = parts.port or {"http": 80, "https": 443}.get(scheme)
    return f"{scheme}://{(parts.hostname or '').rstrip('.')}:{port}"


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


HIGHEST_CONCURRENCY = 1000
HIGHEST_PER_MINUTE = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class EndpointFacts:
    """What of an endpoint can be changed.

    Attributes:
        base_url: Up to and including "/v1" or its like.
        key_variable: Of the workers' environment; empty where no key is needed.
        max_concurrency: So many calls at once, over all workers.
        requests_per_minute: None for no limit.
    """

    base_url: str
    key_variable: str = ""
    max_concurrency: int = 4
    requests_per_minute: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """What somebody knows of a model; None, or nothing, is unknown."""

    model_class: str = ""
    vision: bool | None = None
    native_tools: bool | None = None
    json_schema: bool | None = None
    temperature: bool | None = None
    reasoning_effort: str = ""
    context_tokens: int | None = None
    max_output_tokens: int | None = None
    price_in_usd: Decimal | None = None
    price_out_usd: Decimal | None = None
    price_as_of: date | None = None
    price_source: str = ""


FACTS = tuple(field for field in ModelFacts.__dataclass_fields__)


@transaction.atomic
def add_endpoint(
    *, label: str, facts: EndpointFacts, is_simulated: bool = False, actor: User | None = None
) -> Endpoint:
    """A new endpoint.

    Args:
        label: Lower-case letters, digits and hyphens; what commands call it, for ever.
        facts: Where it is, and its limits.
        is_simulated: Whether what it answers counts as simulated, for ever.
        actor: Who adds it.

    Raises:
        InvalidDocument: Something can't be used, each with what is allowed.
        Conflict: There is one of that label.
    """
    check_slug(label, what="endpoint")
    if Endpoint.objects.filter(label=label).exists():
        raise Conflict(f"There is an endpoint “{label}” already; choose another label.")
    row = Endpoint(label=label, is_simulated=is_simulated, **check_facts(facts))
    row.save()
    log_event(
        actor=actor, verb="add", object_kind="endpoint", object_code=row.code, after=facts_of(row)
    )
    return row


@transaction.atomic
def change_endpoint(
    row: Endpoint, *, facts: EndpointFacts, may_move_key: bool = False, actor: User | None = None
) -> Endpoint:
    """Another address, key variable or limits; they count for the next call.

    Raises:
        InvalidDocument: Something can't be used.
        Conflict: Its key would go to another server, and nobody said that it may.
    """
    row = Endpoint.objects.select_for_update(no_key=True).get(pk=row.pk)
    wanted = check_facts(facts)
    move = move_of(endpoint=row, base_url=wanted["base_url"], key_variable=facts.key_variable)
    if move is not None and not may_move_key:
        raise Conflict(
            f"The key in {facts.key_variable} went to {move[0]} and would go to {move[1]}. "
            "Say that it may, if that is meant."
        )
    before = facts_of(row)
    for name, value in wanted.items():
        setattr(row, name, value)
    row.save(update_fields=list(wanted))
    _log_change(row, before, actor)
    log_move(move, endpoint=row, actor=actor)
    return row


@transaction.atomic
def add_model(endpoint: Endpoint, *, model: str, actor: User | None = None) -> EndpointModel:
    """What is known of a model there: its listed price, and nothing else yet.

    Raises:
        InvalidDocument: The model id can't be used.
        Conflict: The endpoint has it already.
    """
    model = one_line("model", model, what="endpoint")
    before = facts_of(endpoint)
    if endpoint.models.filter(model=model).exists():
        raise Conflict(f"{endpoint.label} has the model {model} already.")
    row = model_at(endpoint=endpoint, model=model)
    _log_change(endpoint, before, actor)
    return row


@transaction.atomic
def change_model(
    row: EndpointModel, *, facts: ModelFacts, actor: User | None = None
) -> EndpointModel:
    """What somebody says of a model. It counts for contestants that have not run yet.

    Raises:
        InvalidDocument: A fact can't be, or a price lacks its other half, its date or its source.
    """
    row = (
        EndpointModel.objects.select_for_update(of=("self",))
        .select_related("endpoint")
        .get(pk=row.pk)
    )
    before = facts_of(row.endpoint)
    for name in FACTS:
        setattr(row, name, getattr(facts, name))
    _refuse_broken(row, "model")
    row.save(update_fields=list(FACTS))
    _log_change(row.endpoint, before, actor)
    return row


# --- Private -----------------------------------------------------------------------------------


def check_facts(facts: EndpointFacts) -> dict[str, Any]:
    """Return the facts as columns.

    Raises:
        InvalidDocument: With every fault at its place.
    """
    problems: list[tuple[str, str]] = []
    base_url = facts.base_url
    try:
        base_url = check_base_url(facts.base_url.strip())
    except InvalidDocument as error:
        problems += error.problems
    try:
        check_key_variable(facts.key_variable)
    except InvalidDocument as error:
        problems += error.problems
    for name, highest in (
        ("max_concurrency", HIGHEST_CONCURRENCY),
        ("requests_per_minute", HIGHEST_PER_MINUTE),
    ):
        value = getattr(facts, name)
        if value is not None and not 1 <= value <= highest:
            problems.append((name, f"a whole number from 1 to {highest}"))
    if problems:
        raise InvalidDocument("endpoint", problems)
    return {
        "base_url": base_url,
        "key_variable": facts.key_variable,
        "max_concurrency": facts.max_concurrency,
        "requests_per_minute": facts.requests_per_minute,
    }


def _refuse_broken(row: models.Model, what: str) -> None:
    """Raise InvalidDocument with what the row itself says of its faults."""
    try:
        row.full_clean(validate_unique=False, validate_constraints=False)
    except ValidationError as error:
        problems = [
            (name, str(text)) for name, texts in error.message_dict.items() for text in texts
        ]
        raise InvalidDocument(what, problems) from None
    price = [getattr(row, name) for name in ("price_in_usd", "price_out_usd")]
    if any(part is not None and part < 0 for part in price):
        raise InvalidDocument(what, [("price_in_usd", "a price is 0 or more")])


def _log_change(endpoint: Endpoint, before: dict[str, Any], actor: User | None) -> None:
    after = facts_of(endpoint)
    if after != before:
        log_event(
            actor=actor,
            verb="change",
            object_kind="endpoint",
            object_code=endpoint.code,
            before=before,
            after=after,
        )
