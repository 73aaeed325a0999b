from collections.abc import Iterator

import pytest

from augment.fake_llm.server import FakeServer, running
from tests.intents import intents


@pytest.fixture(scope="session")
def server() -> Iterator[FakeServer]:
    with running(slow_s=3600.0, intents=intents) as serving:
        yield serving
