from __future__ import annotations

from decimal import Decimal

import pytest

from augment.llm.costs import IMAGE_TOKENS, Price, nano_usd_of, usd_of, worst_case
from augment.llm.messages import Message, Request, Speaker

GPT_4O = Price(prompt_usd=Decimal("2.50"), completion_usd=Decimal("10"))


def request(text: str = "x", *, images: tuple[bytes, ...] = (), max_tokens: int = 100) -> Request:
    message = Message(speaker=Speaker.USER, text=text, images=images)
    return Request(model="m", messages=(message,), max_tokens=max_tokens)


def test_a_bill_is_counted_in_whole_nano_dollars() -> None:
    assert GPT_4O.nano_usd(prompt_tokens=1_000_000, completion_tokens=0) == nano_usd_of(
        Decimal("2.5")
    )
    assert usd_of(GPT_4O.nano_usd(prompt_tokens=900, completion_tokens=120)) == Decimal("0.00345")


@pytest.mark.parametrize("text", ["", "a" * 5000, "3.14, -2.71; " * 400, "ü€😀" * 300, "\ud800"])
def test_no_text_has_more_tokens_than_bytes_and_those_are_the_bound(text: str) -> None:
    needed = len(text.encode("utf-8", "surrogatepass"))
    assert worst_case(request(text)).prompt_tokens >= needed


def test_images_count_by_themselves_and_not_by_their_bytes() -> None:
    none = worst_case(request()).prompt_tokens
    small = worst_case(request(images=(b"1", b"2"))).prompt_tokens
    assert worst_case(request(images=(b"1" * 99_999, b"2"))).prompt_tokens == small
    assert small - none >= 2 * IMAGE_TOKENS


def test_the_answer_may_use_its_whole_length() -> None:
    worst = worst_case(request(max_tokens=777))
    assert (worst.completion_tokens, worst.tokens) == (777, worst.prompt_tokens + 777)
