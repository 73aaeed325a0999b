import base64
import hashlib
import random
from dataclasses import replace
from decimal import Decimal

import pytest

from augment.errors import ModelFault
from augment.llm.client import ModelProfile, Patience
from augment.llm.costs import (
    IMAGE_TOKENS,
    Price,
    find_cut,
    least_tokens,
    to_nano_usd,
    to_usd,
    worst_case,
)
from augment.llm.messages import (
    Message,
    Reply,
    Request,
    Speaker,
    Tool,
    image_reference,
    request_hash,
    shorten,
)


def test_an_image_goes_as_a_png_data_url_after_the_text() -> None:
    message = Message(speaker=Speaker.USER, text="Look", images=(b"\x89PNG",))
    content = message.to_document()["content"]
    assert isinstance(content, list)
    assert [part["type"] for part in content] == ["text", "image_url"]
    url = content[1]["image_url"]["url"]
    assert base64.b64decode(url.removeprefix("data:image/png;base64,")) == b"\x89PNG"


@pytest.mark.parametrize("length", [41, 1000, 10_000_000])
def test_a_text_that_is_too_long_says_how_long_it_was(length: int) -> None:
    shown = shorten("x" * length, 40)
    assert len(shown) == 40
    assert shown.startswith("xx")
    assert shown.endswith(f"x… [cut: {length} characters]")


LOOK = Message(speaker=Speaker.USER, text="Look.", images=(b"png",))
ASKED = Request(model="m", messages=(LOOK,), max_tokens=10, temperature=0.5, seed=1)


def hash_of(
    request: Request = ASKED, *, base_url: str = "http://a/v1", version: str = "p1"
) -> str:
    document = request.to_document(image_url=image_reference)
    return request_hash(base_url=base_url, document=document, prompt_version=version)


def test_an_image_is_named_by_its_bytes_and_not_carried_along() -> None:
    document = ASKED.to_document(image_url=image_reference)
    assert hashlib.sha256(b"png").hexdigest() in str(document)
    assert "base64" not in str(document)


def test_everything_that_an_answer_depends_on_changes_the_hash() -> None:
    others = [
        hash_of(base_url="http://b/v1"),
        hash_of(version="p2"),
        hash_of(replace(ASKED, model="n")),
        hash_of(replace(ASKED, max_tokens=11)),
        hash_of(replace(ASKED, temperature=None)),
        hash_of(replace(ASKED, seed=2)),
        hash_of(replace(ASKED, messages=(replace(LOOK, text="Look!"),))),
        hash_of(replace(ASKED, messages=(replace(LOOK, images=(b"other",)),))),
        hash_of(replace(ASKED, messages=(replace(LOOK, speaker=Speaker.SYSTEM),))),
    ]
    assert len({hash_of(), *others}) == 1 + len(others)


GPT_4O = Price(prompt_usd=Decimal("2.50"), completion_usd=Decimal("10"))


def request(text: str = "x", *, images: tuple[bytes, ...] = (), max_tokens: int = 100) -> Request:
    message = Message(speaker=Speaker.USER, text=text, images=images)
    return Request(model="m", messages=(message,), max_tokens=max_tokens)


def test_a_bill_is_counted_in_whole_nano_dollars() -> None:
    assert GPT_4O.nano_usd(prompt_tokens=1_000_000, completion_tokens=0) == to_nano_usd(
        Decimal("2.5")
    )
    tokens = {"prompt_tokens": 900, "completion_tokens": 120}
    assert to_usd(GPT_4O.nano_usd(**tokens)) == Decimal("0.00345")
    cached = replace(GPT_4O, cached_usd=Decimal("1.25"))
    assert to_usd(cached.nano_usd(**tokens, cached_tokens=800)) == Decimal("0.00245")
    assert GPT_4O.nano_usd(**tokens, cached_tokens=800) == GPT_4O.nano_usd(**tokens)


@pytest.mark.parametrize("text", ["", "a" * 5000, "3.14, -2.71; " * 400, "ü€😀" * 300, "\ud800"])
def test_no_text_has_more_tokens_than_bytes_and_those_are_the_bound(text: str) -> None:
    needed = len(text.encode("utf-8", "surrogatepass"))
    assert worst_case(request(text)).prompt_tokens >= needed


def test_images_count_by_themselves_and_not_by_their_bytes() -> None:
    none = worst_case(request()).prompt_tokens
    small = worst_case(request(images=(b"1", b"2"))).prompt_tokens
    assert worst_case(request(images=(b"1" * 99_999, b"2"))).prompt_tokens == small
    assert small - none >= 2 * IMAGE_TOKENS


LONG = 'Lane7: [7, "Eastwards", 3.50, [[-12.25, 1.75], [-7.25, 1.75]]]\n' * 300


WINDOWS = (2048, 4096, 8192)


def reply(prompt: int, completion: int | None, finish: str) -> Reply:
    return Reply(
        text="x", prompt_tokens=prompt, completion_tokens=completion, finish_reason=finish
    )


def test_a_text_has_at_least_so_many_tokens() -> None:
    for text, least in (
        *(("", 0), ("   \n", 0), ("One road, two lanes.", 6), ("21.4", 3), ("-12.25", 4)),
        *(("1234567", 3), ('"x_m": 20.0', 6), ("...", 1)),
    ):
        assert least_tokens(text) == least


def test_a_cut_prompt_shows_in_the_endpoints_count_of_tokens() -> None:
    for text, counted, known, is_cut in (
        # Far below what was sent: a cut prompt at a window alone.
        (LONG, (1200, 10, "stop"), None, False),
        (LONG, (4096, 10, "stop"), None, True),
        # A finished answer to a prompt of exactly a window is sound.
        *(("Hello", (w, 10, "stop"), known, False) for w in WINDOWS for known in (None, w)),
        # At the window, and below the least that the prompt has.
        ("word " * 4096, (4096, 10, "stop"), None, False),
        ("word " * 4097, (4096, 10, "stop"), None, True),
        ("word " * 4097, (4096, 10, "stop"), 4096, True),
        ("word " * 4097, (4096, 10, "stop"), 8192, False),
        # An answer that runs into the window.
        ("Hello", (4000, 96, "length"), None, True),
        ("Hello", (4000, 96, ""), None, True),
        ("Hello", (4000, 96, "stop"), None, False),
        ("Hello", (3000, 1096, "length"), None, False),
        ("Hello", (4000, 95, "length"), None, False),
        ("Hello", (4000, None, "length"), None, False),
    ):
        cut = find_cut(request(text, max_tokens=1000), reply(*counted), context_tokens=known)
        assert (cut is not None) == is_cut
        assert cut is None or not cut.retryable


def fault(*, retryable: bool = True, retry_after_s: float | None = None) -> ModelFault:
    return ModelFault("broken", retryable=retryable, retry_after_s=retry_after_s)


def patience(**changes: float) -> Patience:
    return Patience(rng=random.Random(1), **changes)  # type: ignore[arg-type]


def test_the_wait_doubles_within_its_jitter_and_its_bound() -> None:
    patient = patience(attempts=9, first_wait_s=1.0, longest_wait_s=5.0)
    for attempt, full_s in [(1, 1.0), (2, 2.0), (3, 4.0), (4, 5.0), (5, 5.0)]:
        wait_s = patient.wait_s(fault(), attempt=attempt)
        assert full_s / 2.0 <= wait_s <= full_s


def test_what_the_endpoint_asked_for_is_not_undercut() -> None:
    for asked_s in (12.0, 45.0, 90.0):
        assert patience().wait_s(fault(retry_after_s=asked_s), attempt=1) == asked_s


@pytest.mark.parametrize("asked_s", [90.1, 600.0, float("inf")])
def test_who_asks_for_too_long_a_wait_is_left_for_later(asked_s: float) -> None:
    assert patience().wait_s(fault(retry_after_s=asked_s), attempt=1) is None


HELLO = Message(speaker=Speaker.USER, text="Hello")
TOOL = Tool(name="double", description="Doubles.", parameters={"type": "object"})
SENT = Request(model="m", messages=(HELLO,), temperature=0.0, seed=7)


@pytest.mark.parametrize("parameter", ["temperature", "seed"])
def test_what_was_refused_is_left_out(parameter: str) -> None:
    fitted = ModelProfile().without(parameter).fit(SENT)
    assert fitted == replace(SENT, **{parameter: None})
    assert parameter not in fitted.to_document()


def test_a_model_without_a_limit_of_the_length_is_not_asked() -> None:
    boundless = ModelProfile().without("max_completion_tokens").without("max_tokens")
    with pytest.raises(ModelFault, match="its cost has no bound") as caught:
        boundless.fit(SENT)
    assert not caught.value.retryable


def test_a_blind_model_is_shown_nothing() -> None:
    seen = replace(SENT, messages=(replace(HELLO, images=(b"\x89PNG",)),))
    assert ModelProfile(vision=True).fit(seen) == seen
    with pytest.raises(ModelFault, match="m at this endpoint can't see pictures"):
        ModelProfile(vision=False).fit(seen)


def test_tools_have_the_form_of_the_wire() -> None:
    armed = replace(SENT, tools=(TOOL,))
    function = {"name": "double", "description": "Doubles.", "parameters": {"type": "object"}}
    assert armed.to_document()["tools"] == [{"type": "function", "function": function}]
