"""What models cost, as far as somebody knows. Unknown stays unknown, never zero."""

from __future__ import annotations

from collections.abc import Iterable

from augment.llm.costs import Price
from augment.models import Contestant, Endpoint, EndpointModel
from augment.services.endpoints.treatments import respondents_of


def price_of(endpoint: Endpoint, model: str) -> Price | None:
    """The price of a model at an endpoint, None where it is unknown."""
    row = EndpointModel.objects.filter(endpoint=endpoint, model=model).first()
    if row is None or row.price_in_usd is None or row.price_out_usd is None:
        return None
    return Price(prompt_usd=row.price_in_usd, completion_usd=row.price_out_usd)


def list_unpriced_models(contestants: Iterable[Contestant]) -> list[str]:
    """What the contestants ask models whose price is unknown, as "model at endpoint"."""
    unpriced = {
        str(respondent)
        for row in contestants
        for respondent in respondents_of(row).values()
        if price_of(respondent.endpoint, respondent.model) is None
    }
    return sorted(unpriced)
