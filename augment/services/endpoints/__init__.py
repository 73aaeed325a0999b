"""Contestants and whom they ask: endpoints, keys, prices, limits, and what models can do."""

from augment.services.endpoints.contestants import (
    OPTION_INPUTS,
    REFERENCE,
    VARIANTS,
    ContestantRequest,
    add_contestant,
    ensure_builtin,
    list_unsent_options,
    paper_variants,
    read_options,
    read_respondents,
)
from augment.services.endpoints.known_endpoints import (
    MODEL_FACTS,
    EndpointFacts,
    EndpointRequest,
    add_endpoint,
    ensure_endpoint,
    read_key,
)
from augment.services.endpoints.known_models import Spending, sum_spending, vendor_family
from augment.services.endpoints.probing import add_model, ensure_model, list_models, plan_probe
