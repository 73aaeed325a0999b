"""Endpoints and what is known of their models, for the log, the client and the money."""

from __future__ import annotations

import json
from collections.abc import Iterable
from datetime import datetime
from typing import Any, Protocol

from django.contrib.auth.models import User
from django.core.serializers.json import DjangoJSONEncoder
from django.db import transaction
from django.utils import timezone

from augment.llm.profile import ModelProfile
from augment.models import Endpoint, EndpointModel
from augment.services.endpoints.known_models import listed_price
from augment.services.events import log_event

_LIMITS = (
    *("label", "base_url", "key_variable", "is_simulated"),
    *("max_concurrency", "requests_per_minute"),
)
_KNOWN = (
    *("model", "model_class", "native_tools", "vision", "json_schema", "temperature"),
    *("refused_parameters", "reasoning_effort", "context_tokens", "max_output_tokens"),
    *("price_in_usd", "price_out_usd", "price_as_of", "price_source"),
)


class AskedModel(Protocol):
    """A model at an endpoint."""

    @property
    def endpoint(self) -> Endpoint:
        """Where it is."""

    @property
    def model(self) -> str:
        """Its id there."""


@transaction.atomic
def model_at(*, endpoint: Endpoint, model: str) -> EndpointModel:
    """What is known of the model at the endpoint.

    A new row knows the price, if genai-prices lists it, and nothing else.
    """
    row, made = EndpointModel.objects.get_or_create(endpoint=endpoint, model=model)
    if made and not endpoint.is_simulated:
        _fill_price(row, now=timezone.now())
    return row


def profile_of(*, endpoint: Endpoint, model: str) -> ModelProfile:
    """What the model takes, as far as its row knows; nothing is known of one without a row."""
    row = EndpointModel.objects.filter(endpoint=endpoint, model=model).first()
    return ModelProfile() if row is None else _profile(row)


def profiles_of(asked: Iterable[AskedModel]) -> dict[tuple[int, str], ModelProfile]:
    """The same of several, by the primary key of the endpoint and the model; one query at most."""
    wanted = {(one.endpoint.pk, one.model) for one in asked}
    if not wanted:
        return {}
    rows = EndpointModel.objects.filter(
        endpoint__in={pk for pk, _ in wanted}, model__in={model for _, model in wanted}
    )
    known = {(row.endpoint_id, row.model): _profile(row) for row in rows}
    return {key: known.get(key, ModelProfile()) for key in wanted}


@transaction.atomic
def remember_refusal(*, endpoint: Endpoint, model: str, parameter: str) -> ModelProfile:
    """Note that the model does not take this parameter.

    Returns:
        What it takes now.
    """
    model_at(endpoint=endpoint, model=model)
    rows = EndpointModel.objects.select_for_update(no_key=True)
    row = rows.get(endpoint=endpoint, model=model)
    before = _profile(row)
    after = before.without(parameter)
    if after != before:
        row.temperature, row.json_schema = after.temperature, after.json_schema
        row.refused_parameters = sorted(after.refused)
        row.save(update_fields=["temperature", "json_schema", "refused_parameters"])
        log_event(
            actor=None,
            verb="learn",
            object_kind="model",
            object_code=row.code,
            after={"endpoint": endpoint.label, "model": model, "refuses": parameter},
        )
    return after


@transaction.atomic
def tell_sight(*, endpoint: Endpoint, model: str, sees: bool, actor: User | None = None) -> None:
    """Note what somebody knows of a model without asking it: whether it sees pictures."""
    row = model_at(endpoint=endpoint, model=model)
    before, row.vision = row.vision, sees
    row.save(update_fields=["vision"])
    log_event(
        actor=actor,
        verb="tell",
        object_kind="model",
        object_code=row.code,
        before={"vision": before},
        after={"endpoint": endpoint.label, "model": model, "vision": sees},
    )


def facts_of(endpoint: Endpoint) -> dict[str, Any]:
    """The endpoint and its models as they are stored now, ready for the log."""
    facts: dict[str, Any] = dict(Endpoint.objects.values(*_LIMITS).get(pk=endpoint.pk))
    facts["models"] = list(endpoint.models.order_by("model").values(*_KNOWN))
    # Dates and decimals become texts; a decimal as a number would lose digits.
    document: dict[str, Any] = json.loads(json.dumps(facts, cls=DjangoJSONEncoder))
    return document


# --- Private -----------------------------------------------------------------------------------


def _profile(row: EndpointModel) -> ModelProfile:
    return ModelProfile(
        native_tools=row.native_tools,
        vision=row.vision,
        json_schema=row.json_schema,
        temperature=row.temperature,
        refused=frozenset(row.refused_parameters),
        reasoning_effort=row.reasoning_effort,
        max_output_tokens=row.max_output_tokens,
    )


def _fill_price(row: EndpointModel, *, now: datetime) -> None:
    """Copy the listed price with its date and source; who edits it later has the last word."""
    listed = listed_price(base_url=row.endpoint.base_url, model=row.model, now=now)
    if listed is None:
        return
    row.price_in_usd, row.price_out_usd = listed.in_usd, listed.out_usd
    row.price_as_of, row.price_source = now.date(), listed.source
    row.save(update_fields=["price_in_usd", "price_out_usd", "price_as_of", "price_source"])
