"""One question to a model: sent, recorded and, after a fault that may pass, sent again."""

from __future__ import annotations

from dataclasses import dataclass

from augment.errors import ModelFault
from augment.llm.client import ChatClient
from augment.llm.messages import Reply, Request
from augment.llm.patience import Patience
from augment.variants.transcript import ModelRole, Transcript


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversation:
    """Who is talked to, and what keeps the record."""

    client: ChatClient
    model: str
    transcript: Transcript
    patience: Patience

    def ask(self, role: ModelRole, request: Request, prompt_version: str) -> Reply:
        """The reply to the request; every attempt is in the transcript before it is judged.

        What the transcript knows the answer to is not sent.

        Raises:
            ModelFault: The last attempt broke, or the fault is one that does not pass.
            BudgetSpent: The transcript's budget has no room for the next attempt.
        """
        before = self.transcript.known(role, request, prompt_version)
        if before is not None:
            return before
        attempt = 1
        while True:
            number = self.transcript.asked(role, request, prompt_version)
            try:
                reply = self.client.complete(request)
            except ModelFault as fault:
                self.transcript.broke(number, fault)
                wait_s = self.patience.wait_s(fault, attempt=attempt)
                if wait_s is None:
                    raise
                self.patience.sleep(wait_s)
                attempt += 1
            else:
                self.transcript.answered(number, reply)
                return reply
