"""Facts about the models of endpoints, their prices, and the latency of calls to them.

Unknown stays unknown, never zero. Listed prices come with the package genai-prices, without asking
the network: they are as new as the installed version.
"""

import re
from dataclasses import dataclass
from datetime import datetime
from decimal import Decimal
from importlib.metadata import version

from django.db import transaction
from django.db.models import BigIntegerField, Case, Count, F, Q, Sum, When
from django.db.models.functions import Coalesce
from django.utils import timezone

from augment.llm.client import ModelProfile
from augment.llm.costs import NANO_USD, Price
from augment.models import Augmentation, Endpoint, EndpointModel, ModelCall
from augment.services.events import log_change

AUGMENTATION = "attempt__augmentation"
CONTESTANT = "attempt__augmentation__contestant"

TEMPERATURE = "temperature"
"""The parameter that a row has a column for; the others stand in `refused_parameters`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spending:
    """Use of several calls together.

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


@transaction.atomic
def model_at(*, endpoint: Endpoint, model: str) -> EndpointModel:
    """Return the facts about the model at the endpoint; a new row has its listed price."""
    row, made = EndpointModel.objects.get_or_create(endpoint=endpoint, model=model)
    if made and not endpoint.is_simulated:
        now = timezone.now()
        listed = find_listed_price(base_url=endpoint.base_url, model=model, now=now)
        if listed is not None:
            price, row.price_source = listed
            row.price_in_usd, row.price_out_usd = price.prompt_usd, price.completion_usd
            row.price_cached_usd, row.price_as_of = price.cached_usd, now.date()
            row.save()
    return row


def read_facts(*, endpoint: Endpoint, model: str) -> EndpointModel:
    """Return the facts about a model; an unsaved row if nothing is known."""
    row = EndpointModel.objects.filter(endpoint=endpoint, model=model).first()
    return row or EndpointModel(endpoint=endpoint, model=model)


@transaction.atomic
def remember_refusal(*, endpoint: Endpoint, model: str, parameter: str) -> ModelProfile:
    """Note that the model does not take this parameter; returns what it takes now."""
    model_at(endpoint=endpoint, model=model)
    rows = EndpointModel.objects.select_for_update(no_key=True)
    row = rows.get(endpoint=endpoint, model=model)
    if parameter not in read_profile(row).refused:
        if parameter == TEMPERATURE:
            row.temperature = False
        else:
            row.refused_parameters = sorted({*row.refused_parameters, parameter})
        row.save()
        log_change(
            row, "learn", after={"endpoint": endpoint.label, "model": model, "refuses": parameter}
        )
    return read_profile(row)


def find_price(row: EndpointModel) -> Price | None:
    """Return the price of a model at an endpoint, None where it is unknown."""
    if row.price_in_usd is None or row.price_out_usd is None:
        return None
    return Price(
        prompt_usd=row.price_in_usd,
        completion_usd=row.price_out_usd,
        cached_usd=row.price_cached_usd,
    )


def find_listed_price(*, base_url: str, model: str, now: datetime) -> tuple[Price, str] | None:
    """Return the price of a model and where that is written; None where it is not.

    The vendor is told by the address alone: a model of the same name on somebody else's server
    has another price. Where long prompts cost more, the price is that of short ones.
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
    in_usd, out_usd, cached_usd = (
        getattr(prices.get(name), "base", prices.get(name))
        for name in ("input_mtok", "output_mtok", "cache_read_mtok")
    )
    if not (isinstance(in_usd, Decimal) and isinstance(out_usd, Decimal)):
        return None
    # The vendor's pattern has to end with the host: api.vendor.com.others.net is not theirs.
    match = re.match(price.provider.api_pattern, base_url)
    if match is None or base_url[match.end() :][:1] not in {"", "/", ":"}:
        return None
    source = f"genai-prices {version('genai-prices')}: {price.provider.id}/{price.model.id}"
    return Price(prompt_usd=in_usd, completion_usd=out_usd, cached_usd=cached_usd), source[:200]


def sum_spending(which: Q, *, by: str) -> dict[int, Spending]:
    """Sum the calls of attempts that came to an outcome; one query.

    What was never sent is no call; contestants without a model have no entry.

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
    calls = ModelCall.objects.filter(
        Q(sent_at__isnull=False) | Q(served_from__isnull=False),
        which,
        attempt__outcome__in=[state.value for state in Augmentation.SHOWABLE],
    )
    rows = calls.order_by().values(who=F(by))
    return {
        row["who"]: Spending(
            augmentations=row["augmentations"],
            calls=row["calls"],
            tokens=row["tokens"] if row["with_tokens"] == row["calls"] else None,
            nano_usd=row["money"] if row["with_money"] == row["calls"] else None,
        )
        for row in rows.annotate(
            augmentations=Count("attempt__augmentation", distinct=True),
            calls=Count("pk"),
            tokens=Sum(tokens),
            with_tokens=Count(tokens),
            money=Sum(money),
            with_money=Count(money),
        )
    }


def vendor_family(model: str) -> str:
    """Return the vendor of a model, as far as genai-prices tells it by the name alone.

    Else the first word of the model id, without what stands before its last slash.
    """
    from genai_prices.data_snapshot import get_snapshot

    name = model.rpartition("/")[2].lower()
    try:
        return get_snapshot().find_provider(name, None, None).id
    except LookupError:
        word = re.search(r"[a-z]+", name)
        return word[0] if word else name


def read_profile(row: EndpointModel) -> ModelProfile:
    """Return the parameters that a model takes, as far as known."""
    refused = {TEMPERATURE} if row.temperature is False else set[str]()
    return ModelProfile(
        native_tools=row.native_tools,
        vision=row.vision,
        refused=frozenset(row.refused_parameters) | refused,
        reasoning_effort=row.reasoning_effort,
        max_output_tokens=row.max_output_tokens,
    )
