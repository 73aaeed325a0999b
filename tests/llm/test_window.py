from __future__ import annotations

import pytest

from augment.llm.costs import cut_of, least_tokens
from augment.llm.messages import Message, Reply, Request, Speaker

LONG = 'Lane7: [7, "Eastwards", 3.50, [[-12.25, 1.75], [-7.25, 1.75]]]\n' * 300


def request(text: str = LONG, max_tokens: int = 1000) -> Request:
    message = Message(speaker=Speaker.USER, text=text)
    return Request(model="m", messages=(message,), max_tokens=max_tokens)


def reply(prompt: int | None, completion: int | None = 10, finish: str = "stop") -> Reply:
    return Reply(
        text="x", prompt_tokens=prompt, completion_tokens=completion, finish_reason=finish
    )


@pytest.mark.parametrize(
    ("text", "least"),
    [
        ("", 0),
        ("   \n", 0),
        ("One road, two lanes.", 6),
        ("21.4", 3),
        ("-12.25", 4),
        ("1234567", 3),
        ('"x_m": 20.0', 6),
        ("...", 1),
    ],
)
def test_a_text_has_at_least_so_many_tokens(text: str, least: int) -> None:
    assert least_tokens(text) == least


@pytest.mark.parametrize("counted", [1200, 4096])
def test_a_count_far_below_what_was_sent_is_a_cut_prompt(counted: int) -> None:
    assert least_tokens(LONG) > 6000
    cut = cut_of(request(), reply(counted))
    assert f"counted {counted} tokens, the prompt has at least" in str(cut)
    assert cut is not None
    assert not cut.retryable


@pytest.mark.parametrize("window", [2048, 4096, 8192])
def test_a_finished_answer_to_a_prompt_of_exactly_a_window_is_sound(window: int) -> None:
    assert cut_of(request("Hello"), reply(window)) is None
    assert cut_of(request("Hello"), reply(window), context_tokens=window) is None


@pytest.mark.parametrize(
    ("words", "known", "is_cut"),
    [(4096, None, False), (4097, None, True), (4097, 4096, True), (4097, 8192, False)],
)
def test_a_count_at_the_window_below_the_least_is_a_cut(
    words: int, known: int | None, is_cut: bool
) -> None:
    cut = cut_of(request("word " * words), reply(4096), context_tokens=known)
    assert (cut is not None) == is_cut


@pytest.mark.parametrize(
    ("prompt", "completion", "finish", "is_cut"),
    [
        (4000, 96, "length", True),
        (4000, 96, "", True),
        (4000, 96, "stop", False),
        (3000, 1096, "length", False),
        (4000, 95, "length", False),
        (4000, None, "length", False),
    ],
)
def test_an_answer_that_runs_into_the_window_shows_a_cut(
    prompt: int, completion: int | None, finish: str, is_cut: bool
) -> None:
    cut = cut_of(request("Hello"), reply(prompt, completion, finish))
    assert (cut is not None) == is_cut
