"""A client that answers from a list: for tests of whatever talks to a language model."""

from collections.abc import Iterable

from augment.errors import ModelFault
from augment.llm.client import Sending, watch_nothing
from augment.llm.messages import Reply, Request


class ScriptRanOut(Exception):
    """More was asked than the script has answers: the caller talks more than it should."""


class ScriptedClient:
    """Gives the answers in order, raises those that are faults, and remembers what was asked.

    Attributes:
        requests: Every request so far, in order.
    """

    def __init__(self, answers: Iterable[str | Reply | ModelFault]) -> None:
        self._answers = list(answers)
        self.requests: list[Request] = []

    def fit(self, request: Request) -> Request:
        """The request as it is: a script takes everything."""
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        """The next answer of the script.

        Raises:
            ModelFault: The script says so here.
            ScriptRanOut: There is no further answer.
        """
        sending()
        self.requests.append(request)
        if len(self.requests) > len(self._answers):
            raise ScriptRanOut(f"the script has {len(self._answers)} answers and no more")
        answer = self._answers[len(self.requests) - 1]
        if isinstance(answer, ModelFault):
            raise answer
        if isinstance(answer, Reply):
            return answer
        return Reply(text=answer, model=request.model, finish_reason="stop")
