"""Endpoints and their models as somebody enters and changes them, and the keys they are sent.

A key itself is never stored: an endpoint names a variable and a host, and the variable's value
goes to that host. So only variables that are meant for keys may be named: `*_API_KEY`, and what
ARENA_KEY_VARIABLES lists.
"""

import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any
from urllib.parse import urlsplit

from django.conf import settings
from django.contrib.auth.models import User
from django.core.exceptions import ValidationError
from django.core.serializers.json import DjangoJSONEncoder
from django.db import transaction
from django.forms import model_to_dict

from augment.errors import Conflict, InvalidDocument, KeyMissing, KeyNotAllowed, UnknownName
from augment.llm.addresses import check_base_url
from augment.models import Endpoint, EndpointModel
from augment.services.events import log_change
from augment.services.inputs import InputKind, check_bounds, input_field
from augment.services.scenarios.scenes import check_slug

OPENAI, OPENAI_URL, OPENAI_KEY = "openai", "https://api.openai.com/v1", "OPENAI_API_KEY"

SLUG_RULE = "Lower-case letters, digits, hyphens."
KEY_RULE = "a variable whose name ends in _API_KEY, or one that ARENA_KEY_VARIABLES lists"

_A_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")
_FOR_KEYS = re.compile(r"[A-Za-z_][A-Za-z0-9_]*_API_KEY")


@dataclass(frozen=True, kw_only=True)
class EndpointFacts:
    """What of an endpoint can be changed."""

    base_url: str = input_field(InputKind.TEXT, "Address, up to /v1", most=200)
    key_variable: str = input_field(
        InputKind.TEXT, "Environment variable that holds its key", default="", most=80
    )
    max_concurrency: int = input_field(
        InputKind.WHOLE, "Calls at once, over all workers", default=4, least=1, most=1000
    )
    requests_per_minute: int | None = input_field(
        InputKind.WHOLE,
        "Calls a minute, at most (empty: no limit)",
        default=None,
        least=1,
        most=1_000_000,
    )


@dataclass(frozen=True, kw_only=True)
class EndpointRequest(EndpointFacts):
    """A new endpoint; label and kind stay for ever."""

    label: str = input_field(InputKind.TEXT, "Name", SLUG_RULE, most=80)
    is_simulated: bool = input_field(
        InputKind.SWITCH, "A stand-in: what it answers counts as simulated", default=False
    )


MODEL_FACTS = (
    *("model_class", "price_in_usd", "price_out_usd", "price_as_of", "price_source"),
    *("context_tokens", "max_output_tokens", "reasoning_effort"),
    *("vision", "native_tools", "temperature"),
)
"""What somebody can say of a model; None, or nothing, is unknown."""


@transaction.atomic
def add_endpoint(request: EndpointRequest, actor: User | None = None) -> Endpoint:
    """Add an endpoint.

    Raises:
        InvalidDocument: Something can't be used, each with what is allowed.
        Conflict: There is one of that label.
    """
    check_slug(request.label, what="endpoint", key="label")
    if Endpoint.objects.filter(label=request.label).exists():
        raise Conflict(f"There is an endpoint “{request.label}” already; choose another label.")
    given = check_facts(request)
    row = Endpoint.objects.create(**given)
    log_change(row, "add", actor, after=_facts(row, given))
    return row


@transaction.atomic
def ensure_endpoint(request: EndpointRequest, actor: User | None = None) -> Endpoint:
    """Return the endpoint of that label, added where there is none.

    Raises:
        InvalidDocument: Something can't be used.
        Conflict: There is one of that label with another address or key, or of another kind.
    """
    row = Endpoint.objects.filter(label=request.label).first()
    if row is None:
        return add_endpoint(request, actor)
    given = check_facts(request)
    if any(
        getattr(row, name) != given[name] for name in ("base_url", "key_variable", "is_simulated")
    ):
        raise Conflict(
            f"Endpoint {row.label!r} is at {row.base_url} already; change it on its page or "
            "choose another label."
        )
    return row


@transaction.atomic
def change_endpoint(row: Endpoint, *, facts: EndpointFacts, actor: User | None = None) -> Endpoint:
    """Change address, key variable or limits; they count for the next call.

    Raises:
        InvalidDocument: Something can't be used.
        Conflict: Its key would go to another server than it was entered for.
    """
    row = Endpoint.objects.select_for_update(no_key=True).get(pk=row.pk)
    wanted = check_facts(facts)
    before, after = (urlsplit(url)[:2] for url in (row.base_url, wanted["base_url"]))
    if before != after and row.key_variable and facts.key_variable:
        raise Conflict(
            f"{row.key_variable} was entered for {'://'.join(before)}, and its key must not go to "
            f"{'://'.join(after)}. Add another endpoint, or empty the key's variable first."
        )
    _change(row, wanted, "endpoint", actor)
    return row


def find_endpoint(label: str, actor: User | None = None) -> Endpoint:
    """Return the endpoint of that label; OpenAI's own appears where its key is at hand.

    Raises:
        UnknownName: There is none of that label.
        Conflict: It is OpenAI's, which was not added, and its key is not at hand.
    """
    row = Endpoint.objects.filter(label=label).first()
    if row is not None:
        return row
    if label != OPENAI:
        raise UnknownName(
            "endpoint", label, list(Endpoint.objects.values_list("label", flat=True))
        )
    if OPENAI_KEY not in list_keys():
        raise Conflict(
            f"Endpoint {OPENAI!r} was not added yet: set {OPENAI_KEY} here, or name its address."
        )
    request = EndpointRequest(label=OPENAI, base_url=OPENAI_URL, key_variable=OPENAI_KEY)
    return add_endpoint(request, actor)


@transaction.atomic
def change_model(
    row: EndpointModel, *, facts: Mapping[str, Any], actor: User | None = None
) -> EndpointModel:
    """Store what somebody says of a model. It counts for contestants that have not run yet.

    Args:
        row: Which.
        facts: By the names of MODEL_FACTS.
        actor: Who says so.

    Raises:
        InvalidDocument: A fact can't be, or a price lacks its other half, its date or its source.
    """
    rows = EndpointModel.objects.select_for_update(of=("self",)).select_related("endpoint")
    row = rows.get(pk=row.pk)
    _change(row, {name: facts[name] for name in MODEL_FACTS}, "model", actor)
    return row


def check_facts(facts: EndpointFacts) -> dict[str, Any]:
    """Return the facts as columns.

    Raises:
        InvalidDocument: With every fault at its place.
    """
    problems: list[tuple[str, str]] = []
    base_url = facts.base_url.strip()
    checks: tuple[tuple[Callable[[Any], object], Any], ...] = (
        (check_base_url, base_url),
        (check_key_variable, facts.key_variable),
        (check_bounds, facts),
    )
    for check, value in checks:
        try:
            check(value)
        except InvalidDocument as error:
            problems += error.problems
    if problems:
        raise InvalidDocument("endpoint", problems)
    return asdict(facts) | {"base_url": check_base_url(base_url)}


# --- Keys --------------------------------------------------------------------------------------


def may_hold_key(variable: str) -> bool:
    """Return whether an endpoint may be sent what this variable holds."""
    return bool(_FOR_KEYS.fullmatch(variable)) or variable in settings.KEY_VARIABLES


def check_key_variable(variable: str) -> None:
    """Refuse a variable that an endpoint may not name; none is fine.

    Raises:
        InvalidDocument: It is no name, or not meant for keys. What is no name is not repeated,
            because it may be the key itself.
    """
    problem = ""
    if variable and not _A_NAME.fullmatch(variable):
        problem = "the name of an environment variable is needed, not the key"
    elif variable and not may_hold_key(variable):
        problem = f"{variable} may not be sent to an endpoint: {KEY_RULE} is needed"
    if problem:
        raise InvalidDocument("endpoint", [("key_variable", problem)])


def list_keys() -> list[str]:
    """Return the names, and only the names, of the variables for keys that are set here."""
    return sorted(name for name in os.environ if may_hold_key(name) and os.environ[name].strip())


def key_of(endpoint: Endpoint) -> str | None:
    """Return the endpoint's key, read from the environment at the moment of the call.

    Raises:
        KeyNotAllowed: The variable is not meant for keys, whoever wrote it into the row.
        KeyMissing: The variable is not set; the sentence names it.
    """
    variable = endpoint.key_variable
    if not variable:
        return None
    if not may_hold_key(variable):
        raise KeyNotAllowed(variable, endpoint.label, KEY_RULE)
    key = os.environ.get(variable, "").strip()
    if not key:
        raise KeyMissing(variable, endpoint.label)
    return key


# --- Private -----------------------------------------------------------------------------------


def _change(
    row: Endpoint | EndpointModel, facts: Mapping[str, Any], what: str, actor: User | None
) -> None:
    """Write facts into a row, and a line into the log where they are new.

    Raises:
        InvalidDocument: A fact can't be.
    """
    before = _facts(row, facts)
    for name, value in facts.items():
        setattr(row, name, value)
    try:
        row.full_clean(validate_unique=False, validate_constraints=False)
    except ValidationError as error:
        texts = [(name, str(text)) for name, said in error.message_dict.items() for text in said]
        raise InvalidDocument(what, texts) from None
    row.save(update_fields=list(facts))
    if (after := _facts(row, facts)) != before:
        log_change(row, "change", actor, before=before, after=after)


def _facts(row: Endpoint | EndpointModel, names: Iterable[str]) -> dict[str, Any]:
    """Return columns for the log; dates and decimals as texts, for a number would lose digits."""
    values = model_to_dict(row, list(names))
    document: dict[str, Any] = json.loads(json.dumps(values, cls=DjangoJSONEncoder))
    return document
