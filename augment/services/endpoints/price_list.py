"""Prices as genai-prices lists them, without asking the network. Who is not on it is unknown.

The list comes with the package: it is as new as the installed version.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from decimal import Decimal
from importlib.metadata import version


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
