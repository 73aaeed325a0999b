"""What one model at one endpoint takes, and a request cut to that.

Unknown is None and is tried once: an endpoint that answers 400 about a parameter is remembered.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from augment.errors import ModelFault
from augment.llm.messages import LengthName, Request


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelProfile:
    """The abilities of a model at an endpoint.

    Attributes:
        native_tools, vision, json_schema, temperature: None where nobody knows.
        refused: Names of further parameters that it does not take.
        reasoning_effort: Sent with each request, empty for none.
        max_output_tokens: No answer may be asked to be longer, None without a limit.
    """

    native_tools: bool | None = None
    vision: bool | None = None
    json_schema: bool | None = None
    temperature: bool | None = None
    refused: frozenset[str] = frozenset()
    reasoning_effort: str = ""
    max_output_tokens: int | None = None

    def fitted(self, request: Request) -> Request:
        """The request with what this model takes, and nothing else.

        Raises:
            ModelFault: It can't do without what the model lacks: sight, native tools, a limit of
                the answer's length.
        """
        self._check(request)
        effort = request.reasoning_effort or self.reasoning_effort or None
        limits = [request.max_tokens]
        if self.max_output_tokens is not None:
            limits.append(self.max_output_tokens)
        return replace(
            request,
            max_tokens=min(limits),
            temperature=None if self.temperature is False else request.temperature,
            seed=None if "seed" in self.refused else request.seed,
            reasoning_effort=None if "reasoning_effort" in self.refused else effort,
            answer_schema=None if self.json_schema is False else request.answer_schema,
            length_name=self._length_name(request.length_name),
        )

    def without(self, parameter: str) -> ModelProfile:
        """The same model, that does not take this parameter."""
        if parameter == "temperature":
            return replace(self, temperature=False)
        if parameter == "response_format":
            return replace(self, json_schema=False)
        return replace(self, refused=self.refused | {parameter})

    def _check(self, request: Request) -> None:
        lacks = None
        if self.vision is False and any(message.images for message in request.messages):
            lacks = "can't see pictures, which this variant needs"
        elif self.native_tools is False and request.tools:
            lacks = "has no native tool calls, which this variant was told to use"
        elif self.refused.issuperset(LengthName):
            lacks = "takes no limit of the answer's length, so that its cost has no bound"
        if lacks:
            raise ModelFault(f"{request.model} at this endpoint {lacks}", retryable=False)

    def _length_name(self, wanted: LengthName) -> LengthName:
        left = [name for name in LengthName if name not in self.refused]
        return wanted if wanted in left or not left else left[0]
