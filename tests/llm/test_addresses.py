from __future__ import annotations

import socket
from typing import Any

import pytest

from augment.errors import InvalidDocument
from augment.llm.addresses import check_resolved


def leading_to(*addresses: str) -> Any:
    return lambda host, port, **_: [(0, 0, 0, "", (address, 0)) for address in addresses]


@pytest.mark.parametrize(
    "address", ["169.254.169.254", "fe80::1%eth0", "100.100.100.200", "::ffff:169.254.0.1"]
)
def test_a_name_that_leads_to_a_metadata_address_is_refused(address: str) -> None:
    with pytest.raises(InvalidDocument, match=r"models\.example leads to .*metadata"):
        check_resolved("https://models.example/v1", resolve=leading_to("93.184.216.34", address))


def test_names_of_this_computer_and_of_the_world_pass() -> None:
    check_resolved("http://models.example/v1", resolve=leading_to("127.0.0.1", "::1", "10.0.0.7"))


def test_a_name_that_nobody_knows_passes() -> None:
    def nobody(*_: object, **__: object) -> Any:
        raise socket.gaierror("unknown")

    check_resolved("http://models.example/v1", resolve=nobody)
