"""A client for one endpoint that keeps to its limits and to what its models take."""

from __future__ import annotations

import logging
from contextlib import AbstractContextManager

from augment.errors import ParameterRefused
from augment.llm.client import Sending, watch_nothing
from augment.llm.messages import Reply, Request
from augment.llm.openai_wire import OpenAIWire
from augment.llm.profile import ModelProfile
from augment.models import Endpoint
from augment.services.endpoints.client import Queue, place_at
from augment.services.endpoints.known_models import profile_of, remember_refusal
from augment.services.endpoints.treatments import Treatment

logger = logging.getLogger(__name__)


class EndpointClient(AbstractContextManager["EndpointClient"]):
    """The wire to an endpoint, behind its queue.

    Args:
        wire: Makes the calls; it is closed with this client.
        endpoint: Whose limits and models count.
        queue: How calls wait for their place.
        treatment: What the contestant that asks has sent since its first run; None where nobody
            in particular asks, and what is known now counts.
    """

    def __init__(
        self,
        wire: OpenAIWire,
        endpoint: Endpoint,
        queue: Queue,
        treatment: Treatment | None = None,
    ) -> None:
        self._wire = wire
        self._endpoint = endpoint
        self._queue = queue
        self._treatment = treatment
        self._profiles = {} if treatment is None else treatment.at(endpoint)

    def fitted(self, request: Request) -> Request:
        """The request with what the model is known to take.

        Raises:
            ModelFault: It can't do without something that the model lacks.
        """
        return self._profile(request.model).fitted(request)

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        """The endpoint's answer, after waiting for a place.

        Raises:
            ParameterRefused: A parameter is not taken; it is left out from now on.
            ModelFault: A parameter is not taken any more that earlier answers were made with.
            EndpointBusy: There was no place.
            ModelFault: There was no answer.
            LeaseLost: Nobody needs the answer any more; nothing was sent.
        """
        try:
            with place_at(self._endpoint, self._queue):
                return self._wire.complete(request, sending=sending)
        except ParameterRefused as refused:
            self._learn(request.model, refused)
            raise

    def __exit__(self, *fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._wire.close()

    def _profile(self, model: str) -> ModelProfile:
        if model not in self._profiles:
            self._profiles[model] = profile_of(endpoint=self._endpoint, model=model)
        return self._profiles[model]

    def _learn(self, model: str, refused: ParameterRefused) -> None:
        logger.warning(
            "%s at endpoint %s does not take %r and is not sent it any more: %s",
            model,
            self._endpoint.label,
            refused.parameter,
            refused,
        )
        known = remember_refusal(endpoint=self._endpoint, model=model, parameter=refused.parameter)
        if self._treatment is not None:
            known = self._treatment.without(refused, endpoint=self._endpoint, model=model)
        self._profiles[model] = known
