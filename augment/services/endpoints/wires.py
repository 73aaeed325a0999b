"""The wire to an endpoint, with the key and the limits that hold where this process runs."""

from __future__ import annotations

from collections.abc import Callable

from django.conf import settings

from augment.llm.client import watch_nothing
from augment.llm.openai_wire import MEGABYTE, OpenAIWire
from augment.models import Endpoint
from augment.services.endpoints.known_endpoints import key_of


def wire_to(endpoint: Endpoint, *, still_wanted: Callable[[], None] = watch_nothing) -> OpenAIWire:
    """A wire; its calls are given up where `still_wanted` raises.

    Raises:
        KeyNotAllowed: The variable that the endpoint names is not meant for keys.
        KeyMissing: It is not set here.
        ModelFault: The key can't be sent, or the address is forbidden.
    """
    return OpenAIWire(
        base_url=endpoint.base_url,
        api_key=key_of(endpoint),
        timeout_s=settings.LLM_TIMEOUT_S,
        most_bytes=settings.LLM_ANSWER_MB * MEGABYTE,
        still_wanted=still_wanted,
        proxy_url=settings.LLM_PROXY,
    )
