from datetime import UTC, datetime
from decimal import Decimal

from augment.services.endpoints.known_models import find_listed_price

NOW = datetime(2026, 11, 20, tzinfo=UTC)
OPENAI = "https://api.openai.com/v1"


def test_a_listed_model_has_a_price_and_a_source() -> None:
    found = find_listed_price(base_url=OPENAI, model="gpt-4o", now=NOW)
    price, source = found
    assert (price.prompt_usd, price.completion_usd) == (Decimal("2.5"), Decimal(10))
    assert price.cached_usd == Decimal("1.25")
    assert source.startswith("genai-prices 0.")
    assert source.endswith(": openai/gpt-4o")


def test_a_price_is_that_of_its_day() -> None:
    google = "https://generativelanguage.googleapis.com/v1beta/openai"
    later = datetime(2027, 1, 2, tzinfo=UTC)
    prices = [
        find_listed_price(base_url=google, model="gemini-3.8-flash", now=day)
        for day in (NOW, later)
    ]
    assert [found and found[0].prompt_usd for found in prices] == [Decimal("0.75"), Decimal("1.5")]


def test_what_is_not_listed_is_unknown() -> None:
    for base_url, model in (
        (OPENAI, "gpt-nobody-knows"),
        (OPENAI, "text-embedding-3-small"),
        ("http://127.0.0.1:11434/v1", "gpt-4o"),
        ("https://api.openai.com.example.net/v1", "gpt-4o"),
    ):
        assert find_listed_price(base_url=base_url, model=model, now=NOW) is None
