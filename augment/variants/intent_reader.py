"""The intent reader: a language model puts a sentence into data, once and once more if need be.

It sees the sentence alone. What it read counts for nothing until a person has accepted it.
"""

from __future__ import annotations

from augment.llm.client import ChatClient, Patience
from augment.prompts.fill import read_intent, reader_messages, review_re_ask_messages
from augment.scene.intent import Intent
from augment.variants.respondents import Inquiry, RespondentClient, Respondents
from augment.variants.transcript import ModelRole, Transcript

MAX_TOKENS = 4096


def ask_for_intent(
    instruction: str,
    *,
    client: ChatClient,
    model: str,
    transcript: Transcript,
    patience: Patience | None = None,
) -> Intent:
    """What a model reads out of a sentence.

    Raises:
        ReplyUnreadable: Neither the first answer nor the re-asked one fits the schema.
        ModelRefused: The model declined, or its endpoint's filter did.
        ModelFault: The wire broke for good.
        BudgetSpent: The transcript's budget has no room for the next call.
    """
    respondent = RespondentClient(client=client, model=model)
    respondents = Respondents(
        clients={ModelRole.MODIFIER: respondent, ModelRole.READER: respondent},
        transcript=transcript,
        patience=patience or Patience(),
    )
    inquiry = Inquiry(
        respondents=respondents,
        role=ModelRole.READER,
        again=review_re_ask_messages,
        max_tokens=MAX_TOKENS,
        re_asks=1,
    )
    intent, _, _ = inquiry.read(reader_messages(instruction), read_intent)
    return intent
