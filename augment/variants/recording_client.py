"""One question to a model: sent, recorded and, after a fault that may pass, sent again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from augment.errors import Abandoned, ModelFault, NotSent, ParameterRefused, Unwanted
from augment.llm.client import ChatClient, Patience
from augment.llm.costs import cut_of
from augment.llm.messages import Reply, Request
from augment.variants.transcript import ModelRole, Transcript


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingClient:
    """Who is talked to, and what keeps the record."""

    client: ChatClient
    model: str
    transcript: Transcript
    patience: Patience
    context_tokens: int | None = None

    def ask(self, role: ModelRole, request: Request, prompt_version: str) -> Reply:
        """The reply to the request; every attempt is in the transcript before it is judged.

        The request goes without what the model does not take, and what the transcript knows the
        answer to is not sent.

        Raises:
            ContextTruncated: There is an answer, but to a part of the prompt.
            ModelFault: The last attempt broke, or the fault is one that does not pass.
            BudgetSpent: The transcript's budget has no room for the next attempt.
            Unwanted: Nobody needs the reply any more.
        """
        while True:
            sent = self.client.fitted(request)
            reply = self.transcript.known(role, sent, prompt_version)
            try:
                reply = reply or self._answer(role, sent, prompt_version)
            except ParameterRefused:
                if self.client.fitted(request) == sent:
                    raise
                continue
            return reply

    def _answer(self, role: ModelRole, request: Request, prompt_version: str) -> Reply:
        """The reply to the request as it is, after as many attempts as patience allows."""
        attempt = 1
        while True:
            number = self.transcript.asked(role, request, prompt_version)
            try:
                sending = partial(self.transcript.sending, number)
                reply = self.client.complete(request, sending=sending)
            except Unwanted as why:
                self.transcript.broke(number, NotSent(f"not sent: {why}"))
                raise
            except Abandoned as fault:
                self.transcript.broke(number, fault)
                raise fault.why from None
            except ModelFault as fault:
                self.transcript.broke(number, fault)
                wait_s = self.patience.wait_s(fault, attempt=attempt)
                if wait_s is None or isinstance(fault, ParameterRefused):
                    raise
                self.patience.sleep(wait_s)
                attempt += 1
            else:
                cut = cut_of(request, reply, context_tokens=self.context_tokens)
                self.transcript.answered(number, reply, cut)
                if cut is not None:
                    raise cut
                return reply
