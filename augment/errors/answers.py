"""What goes wrong when a model is asked: no answer, one that can not be read, a refusal."""

from __future__ import annotations

from augment.errors import AugmentError


class ReplyUnreadable(AugmentError):
    """A model's answer could not be read. Ask once more with the problems, then give up.

    Args:
        problems: What was wrong, each a sentence that can go back to the model.
    """

    def __init__(self, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("The answer can't be read: " + "; ".join(problems))


class ToolError(AugmentError):
    """A model called a tool in a way that has no answer. Give it the sentence; it may call again.

    Args:
        tool: The name of the tool.
        problem: What is wrong, and what would be right.
    """

    def __init__(self, tool: str, problem: str) -> None:
        self.tool = tool
        self.problem = problem
        super().__init__(f"{tool}: {problem}")


class ModelFault(AugmentError):
    """The wire or the endpoint broke before there was an answer.

    Args:
        message: What happened, free of keys.
        retryable: Whether the same request may succeed later.
        status: The HTTP status, if there was one.
        retry_after_s: How long the endpoint asked to be left alone.
    """

    def __init__(
        self,
        message: str,
        *,
        retryable: bool,
        status: int | None = None,
        retry_after_s: float | None = None,
    ) -> None:
        self.retryable = retryable
        self.status = status
        self.retry_after_s = retry_after_s
        super().__init__(message)


class ParameterRefused(ModelFault):
    """The endpoint does not take one parameter of the request. Send it again without.

    Args:
        parameter: Its name on the wire.
        message: What the endpoint said, free of keys.
        status: The HTTP status.
    """

    def __init__(self, parameter: str, message: str, *, status: int) -> None:
        self.parameter = parameter
        super().__init__(message, retryable=True, status=status)


class NotSent(ModelFault):
    """The request never left this computer: there is nothing to be billed for.

    Args:
        message: What kept it here.
        retryable: Whether it may get through later.
    """

    def __init__(self, message: str, *, retryable: bool = False) -> None:
        super().__init__(message, retryable=retryable)


class EndpointBusy(NotSent):
    """No place was free at the endpoint; nothing was sent. Raise its limits or wait.

    Args:
        endpoint: Its label.
        waited_s: For how long somebody waited.
    """

    def __init__(self, endpoint: str, waited_s: float) -> None:
        self.endpoint = endpoint
        super().__init__(
            f"no place was free at endpoint {endpoint!r} for {waited_s:g} s: "
            "raise its limits or run fewer workers"
        )


class ContextTruncated(ModelFault):
    """The endpoint silently cut the prompt. Give it a larger window; asking again cuts again.

    Args:
        message: What shows it, with numbers.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message, retryable=False)


class ModelRefused(AugmentError):
    """The model answered that it will not do this. An outcome, never retried."""


class ReviewUnusable(AugmentError):
    """A review could not be had. What was reviewed stands without one.

    Args:
        reason: Who failed and how.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"The review is unusable: {reason}")
