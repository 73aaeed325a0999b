from __future__ import annotations

import pytest

from augment.errors import ModelFault
from augment.llm.messages import Reply, Request
from augment.llm.scripted import ScriptedClient, ScriptRanOut

ASKED = Request(model="m", messages=())


def test_answers_come_in_order_and_faults_are_raised() -> None:
    fault = ModelFault("gone", retryable=True)
    client = ScriptedClient(["one", fault, Reply(text="two", finish_reason="length")])
    assert client.complete(ASKED).text == "one"
    with pytest.raises(ModelFault, match="gone"):
        client.complete(ASKED)
    assert client.complete(ASKED).finish_reason == "length"
    assert client.requests == [ASKED] * 3


def test_asking_more_than_the_script_has_is_an_error_of_the_test() -> None:
    with pytest.raises(ScriptRanOut, match="0 answers"):
        ScriptedClient([]).complete(ASKED)
