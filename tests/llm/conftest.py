from collections.abc import Iterator

import pytest

from augment.fake_llm.server import FakeServer, running
from tests.intents import known


@pytest.fixture(scope="session")
def server() -> Iterator[FakeServer]:
    with running(slow_s=3600.0, known=known) as serving:
        yield serving
