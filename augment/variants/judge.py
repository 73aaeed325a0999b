"""A language model that compares two pictures, and what its answers in both orders say. Pure."""

from enum import StrEnum

from augment.llm.client import ChatClient
from augment.llm.costs import Price, worst_case
from augment.llm.messages import Request
from augment.prompts.fill import JudgeQuestion, Shown, judge_messages
from augment.prompts.reply import JudgeAnswer, read_judge
from augment.variants.respondents import ModelRole, RespondentClient, Transcript, ask_alone

JUDGE_TOKENS = 4096
"""The length limit of an answer: room for a model that thinks before it."""
UNREADABLE = "unreadable"


class Exchange(StrEnum):
    """Outcome of a judge's two answers about a pair; all but KEPT are ties."""

    KEPT = "kept"
    EQUAL = "equal"
    LOST = "lost"
    UNREADABLE = "unreadable"


def exchange(first: str, second: str) -> Exchange:
    """Compare the answers with the left picture as A and with the right one as A.

    A preference that the exchange of the pictures turned, or that was there in one order alone,
    is lost.
    """
    if UNREADABLE in (first, second):
        return Exchange.UNREADABLE
    if first == second == "equal":
        return Exchange.EQUAL
    return Exchange.KEPT if {first, second} == {"A", "B"} else Exchange.LOST


def combine_answers(first: str, second: str) -> int:
    """Return 1 where the left picture was preferred in both orders, -1 the right one, else 0."""
    if exchange(first, second) is not Exchange.KEPT:
        return 0
    return 1 if first == "A" else -1


def ask_judge(
    question: JudgeQuestion,
    instruction: str,
    pictures: tuple[Shown, Shown],
    *,
    client: ChatClient,
    model: str,
    transcript: Transcript,
) -> JudgeAnswer:
    """Ask once which of two pictures (A first) is better.

    Raises:
        ReplyUnreadable: The answer holds no decision; nobody asks again.
        ModelRefused: The model declined, or its endpoint's filter did.
        ModelFault: The wire broke for good.
        BudgetSpent: The transcript's budget has no room for the call.
    """
    return ask_alone(
        RespondentClient(client=client, model=model),
        ModelRole.JUDGE,
        judge_messages(question, instruction, pictures),
        read_judge,
        transcript=transcript,
        sampling={"temperature": 0.0},
        max_tokens=JUDGE_TOKENS,
        re_asks=0,
    )


def most_nano_usd(instruction: str, price: Price) -> int:
    """Return the largest cost of one question to a judge, in nano-dollars."""
    messages = judge_messages(JudgeQuestion.INSTRUCTION, instruction, ((b"", b""), (b"", b"")))
    request = Request(model="", messages=messages, max_tokens=JUDGE_TOKENS)
    return worst_case(request).nano_usd(price) or 0
