"""Endpoints and what is known of their models, for the log, the client and the money."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from decimal import Decimal
from importlib.metadata import version
from typing import Any, Protocol

from django.contrib.auth.models import User
from django.core.serializers.json import DjangoJSONEncoder
from django.db import transaction
from django.db.models import BigIntegerField, Case, Count, F, Q, Sum, When
from django.db.models.functions import Coalesce
from django.utils import timezone

from augment.llm.client import ModelProfile
from augment.llm.costs import NANO_USD, Price
from augment.models import Augmentation, Endpoint, EndpointModel, ModelCall
from augment.services.events import log_event


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedPrice:
    """USD per million tokens of the prompt and of the answer, and where that is written."""

    in_usd: Decimal
    out_usd: Decimal
    source: str


def listed_price(*, base_url: str, model: str, now: datetime) -> ListedPrice | None:
    """What the model costs at that address at that time, None where the list does not say.

    The vendor is told by the address alone: a model of the same name on somebody else's server
    has another price. Where long prompts cost more, the price is that of short ones and the
    source says up to how many tokens.
    """
    import genai_prices

    try:
        price = genai_prices.calc_price(
            genai_prices.Usage(input_tokens=1, output_tokens=1),
            model,
            provider_api_url=base_url,
            genai_request_timestamp=now,
        )
    except (LookupError, ValueError):
        return None
    prices = vars(price.model_price)
    in_usd, up_to = _base_of(prices.get("input_mtok"))
    out_usd, _ = _base_of(prices.get("output_mtok"))
    if (
        in_usd is None
        or out_usd is None
        or not _is_whole_host(price.provider.api_pattern, base_url)
    ):
        return None
    source = f"genai-prices {version('genai-prices')}: {price.provider.id}/{price.model.id}"
    if up_to is not None:
        source += f", prompts up to {up_to} tokens"
    return ListedPrice(in_usd=in_usd, out_usd=out_usd, source=source[:200])


# --- Private -----------------------------------------------------------------------------------


def _base_of(price: object) -> tuple[Decimal | None, int | None]:
    """The price of a short prompt, and from where on it costs more."""
    if isinstance(price, Decimal):
        return price, None
    base, tiers = getattr(price, "base", None), getattr(price, "tiers", None)
    if isinstance(base, Decimal):
        return base, tiers[0].start if tiers else None
    return None, None


def _is_whole_host(pattern: str, base_url: str) -> bool:
    """Whether the vendor's pattern ends with the host: api.vendor.com.others.net is not theirs."""
    match = re.match(pattern, base_url)
    return match is not None and base_url[match.end() :][:1] in {"", "/", ":"}


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


def price_of(endpoint: Endpoint, model: str) -> Price | None:
    """The price of a model at an endpoint, None where it is unknown."""
    row = EndpointModel.objects.filter(endpoint=endpoint, model=model).first()
    if row is None or row.price_in_usd is None or row.price_out_usd is None:
        return None
    return Price(prompt_usd=row.price_in_usd, completion_usd=row.price_out_usd)


AUGMENTATION = "attempt__augmentation"
CONTESTANT = "attempt__augmentation__contestant"


@dataclass(frozen=True, slots=True, kw_only=True)
class Spending:
    """What calls took together.

    An answer from the store counts as what it had cost when it was asked for: the question is
    what an outcome costs, not what this job or study did.

    Attributes:
        augmentations: How many of them asked a model.
        tokens: Prompt and completion, None where a call does not say.
        nano_usd: None where the price of a call is unknown.
    """

    augmentations: int
    calls: int
    tokens: int | None
    nano_usd: int | None

    @property
    def usd(self) -> float | None:
        """The same in dollars."""
        return None if self.nano_usd is None else self.nano_usd / NANO_USD


def sum_spending(which: Q, *, by: str) -> dict[int, Spending]:
    """The calls of attempts that came to an outcome; what was never sent is no call. One query.

    Args:
        which: Of all calls.
        by: AUGMENTATION or CONTESTANT, whose primary keys are given.
    """
    tokens = Coalesce(
        F("served_from__prompt_tokens") + F("served_from__completion_tokens"),
        F("prompt_tokens") + F("completion_tokens"),
        # An endpoint that answered with an error used none, and that is known.
        Case(When(is_cost_estimated=False, served_from=None, then=F("spent_tokens"))),
        output_field=BigIntegerField(),
    )
    money = Coalesce("served_from__cost_nano_usd", "cost_nano_usd")
    rows = (
        ModelCall.objects.filter(
            Q(sent_at__isnull=False) | Q(served_from__isnull=False),
            which,
            attempt__outcome__in=[state.value for state in Augmentation.SHOWABLE],
        )
        .order_by()
        .values(who=F(by))
        .annotate(
            augmentations=Count("attempt__augmentation", distinct=True),
            calls=Count("pk"),
            tokens=Sum(tokens),
            with_tokens=Count(tokens),
            money=Sum(money),
            with_money=Count(money),
        )
    )
    return {
        row["who"]: Spending(
            augmentations=row["augmentations"],
            calls=row["calls"],
            tokens=row["tokens"] if row["with_tokens"] == row["calls"] else None,
            nano_usd=row["money"] if row["with_money"] == row["calls"] else None,
        )
        for row in rows
    }
