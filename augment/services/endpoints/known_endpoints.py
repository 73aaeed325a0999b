"""Endpoints and their models as somebody enters and changes them, and the keys they are sent.

A key itself is never stored: an endpoint names a variable and a host, and the variable's value
goes to that host. So only variables that are meant for keys may be named: `*_API_KEY`, and what
ARENA_KEY_VARIABLES lists. Each goes only to the hosts that it is bound to: by that setting, as a
known vendor's, or by the upgrade that began to bind keys.
"""

import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib import resources
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.core.exceptions import ValidationError
from django.core.serializers.json import DjangoJSONEncoder
from django.db import transaction
from django.forms import model_to_dict

from augment.errors import Conflict, InvalidDocument, KeyMissing, KeyNotAllowed, UnknownName
from augment.llm.addresses import check_base_url
from augment.llm.wire_transport import host_and_port
from augment.models import Endpoint, EndpointModel, KeyBinding
from augment.services.events import log_change
from augment.services.inputs import InputKind, check_bounds, input_field
from augment.services.texts import check_slug, free_slug

OPENAI, OPENAI_URL, OPENAI_KEY = "openai", "https://api.openai.com/v1", "OPENAI_API_KEY"

KEY_RULE = "a variable whose name ends in _API_KEY, or one that ARENA_KEY_VARIABLES lists"

_VENDORS = resources.files(__package__).joinpath("vendor_keys.txt").read_text().split()
"""Variables of known vendors with the hosts that their keys are for; as ARENA_KEY_VARIABLES."""

_A_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")
_FOR_KEYS = re.compile(r"[A-Za-z_][A-Za-z0-9_]*_API_KEY")


@dataclass(frozen=True, kw_only=True)
class EndpointFacts:
    """Facts about an endpoint that can be changed."""

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

    label: str = input_field(
        InputKind.TEXT,
        "Name",
        "Lower-case letters, digits, hyphens. Empty: made of the address.",
        default="",
        most=80,
    )
    is_simulated: bool = input_field(
        InputKind.SWITCH, "A stand-in: what it answers counts as simulated", default=False
    )


MODEL_FACTS = (
    *("model_class", "price_in_usd", "price_out_usd", "price_cached_usd"),
    *("price_as_of", "price_source"),
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
    request = replace(request, label=request.label or _make_label(request.base_url))
    check_slug(request.label, what="endpoint", key="label")
    if Endpoint.objects.filter(label=request.label).exists():
        raise Conflict(f"There is an endpoint “{request.label}” already; choose another label.")
    facts = check_facts(request)
    row = Endpoint.objects.create(**facts)
    log_change(row, "add", actor, after=_facts(row, facts))
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
    facts = check_facts(request)
    if any(
        getattr(row, name) != facts[name] for name in ("base_url", "key_variable", "is_simulated")
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
        InvalidDocument: Something can't be used, or its key is not bound to that host.
    """
    row = Endpoint.objects.select_for_update(no_key=True).get(pk=row.pk)
    wanted = check_facts(facts)
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


def check_facts(facts: EndpointFacts, *, is_stored: bool = False) -> dict[str, Any]:
    """Return the facts as columns; of a stored row whatever its key is bound to today.

    Raises:
        InvalidDocument: With every fault at its place.
    """
    problems: list[tuple[str, str]] = []
    base_url = facts.base_url.strip()
    key_goes_to = None if is_stored else base_url
    checks: tuple[tuple[Callable[[Any], object], Any], ...] = (
        (check_base_url, base_url),
        (partial(check_key_variable, base_url=key_goes_to), facts.key_variable),
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
    """Return whether a variable is meant for keys at all."""
    return bool(_FOR_KEYS.fullmatch(variable)) or variable in _read_bindings()


def find_key_obstacle(variable: str, base_url: str | None) -> str:
    """Return why an endpoint may not be sent a variable; empty where it may.

    Args:
        variable: That the endpoint names; empty for none.
        base_url: Of the endpoint; None to ask for the variable's name alone.
    """
    if variable and not may_hold_key(variable):
        return f"{variable} may not be sent to an endpoint: {KEY_RULE} is needed"
    if not variable or base_url is None:
        return ""
    server, hosts = host_and_port(base_url), _read_bindings().get(variable, "").split("|")
    if server.endswith(":443") and base_url[:5].lower() == "http:":
        return f"{variable} would go to {server} unencrypted: https is needed"
    # A host without a port stands for all of its ports; with two ports it is no address.
    anywhere = server[server.rfind(":") :]
    bound = {host_and_port(f"https://{host}{port}") for host in hosts for port in ("", anywhere)}
    if server in bound - {""}:
        return ""
    if server and KeyBinding.objects.filter(variable=variable, server=server).exists():
        return ""
    return (
        f"{variable} is not bound to {server}: whoever runs the server and its workers sets "
        f"ARENA_KEY_VARIABLES={variable}={server} there"
    )


def check_key_variable(variable: str, base_url: str | None) -> None:
    """Refuse a variable that an endpoint of that address may not name; as `find_key_obstacle`.

    Raises:
        InvalidDocument: It is no name, or its key may not go there. What is no name is not
            repeated, because it may be the key itself.
    """
    problem = "the name of an environment variable is needed, not the key"
    if not variable or _A_NAME.fullmatch(variable):
        problem = find_key_obstacle(variable, base_url)
    if problem:
        raise InvalidDocument("endpoint", [("key_variable", problem)])


def list_keys() -> list[str]:
    """Return the names, and only the names, of the variables for keys that are set here."""
    return sorted(name for name in os.environ if may_hold_key(name) and os.environ[name].strip())


def read_key(endpoint: Endpoint) -> str | None:
    """Return the endpoint's key, read from the environment at the moment of the call.

    Raises:
        KeyNotAllowed: The key may not go there, whoever wrote variable or address into the row.
        KeyMissing: The variable is not set; the sentence names it.
    """
    variable = endpoint.key_variable
    if not variable:
        return None
    if obstacle := find_key_obstacle(variable, endpoint.base_url):
        raise KeyNotAllowed(f"The key of endpoint {endpoint.label!r} is not sent: {obstacle}.")
    key = os.environ.get(variable, "").strip()
    if not key:
        raise KeyMissing(
            f"The environment variable {variable}, which holds the key of endpoint "
            f"{endpoint.label!r}, is not set where the worker runs."
        )
    return key


# --- Private -----------------------------------------------------------------------------------


def _read_bindings() -> dict[str, str]:
    """Return the hosts of each variable, `HOST|HOST`; empty for one that is only named."""
    bindings: dict[str, str] = {}
    for entry in (*_VENDORS, *settings.KEY_VARIABLES):
        name, _, hosts = entry.partition("=")
        bindings[name] = hosts or bindings.get(name, "")
    return bindings


def _make_label(base_url: str) -> str:
    """Return the host of an address as a label that no endpoint has."""
    server = host_and_port(base_url).removesuffix(":443").removesuffix(":80")
    return free_slug(Endpoint.objects, server, otherwise="endpoint", column="label")


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
        texts = [
            (name, str(text)) for name, messages in error.message_dict.items() for text in messages
        ]
        raise InvalidDocument(what, texts) from None
    row.save(update_fields=list(facts))
    if (after := _facts(row, facts)) != before:
        log_change(row, "change", actor, before=before, after=after)


def _facts(row: Endpoint | EndpointModel, names: Iterable[str]) -> dict[str, Any]:
    """Return columns for the log; dates and decimals as texts, for a number would lose digits."""
    values = model_to_dict(row, list(names))
    document: dict[str, Any] = json.loads(json.dumps(values, cls=DjangoJSONEncoder))
    return document
