from typing import Any

import pytest

from augment.errors import InvalidDocument
from augment.llm.addresses import check_base_url, resolve_host


def leading_to(*addresses: str) -> Any:
    return lambda host, port, **_: [(0, 0, 0, "", (address, 0)) for address in addresses]


FORBIDDEN = (
    # Link-local, metadata of Alibaba, Oracle, Azure, AWS and its pods, Google, Scaleway.
    *("169.254.169.254", "169.254.0.0", "169.254.255.255", "fe80::1%eth0", "febf::1"),
    *("100.100.100.200", "192.0.0.192", "168.63.129.16"),
    *("fd00:ec2::254", "fd00:ec2::23", "fd20:ce::254", "fd00:42::42"),
    # IPv4 in IPv6: mapped, compatible, translated; also of addresses that are fine by themselves.
    *(
        "::ffff:169.254.0.1",
        "::ffff:10.0.0.7",
        "::ffff:0:0",
        "::10.0.0.7",
        "::2",
        "::ffff:0:1.2.3.4",
    ),
    # NAT64, its local prefix, Teredo, 6to4: each from its first to its last address.
    *("64:ff9b::", "64:ff9b::169.254.169.254", "64:ff9b::255.255.255.255"),
    *("64:ff9b:1::", "64:ff9b:1:ffff:ffff:ffff:ffff:ffff"),
    *("2001::", "2001:0:ffff:ffff:ffff:ffff:ffff:ffff"),
    *("2002::", "2002:a9fe:a9fe::1", "2002:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),
    *("::", "0.0.0.0", "ff02::1", "224.0.0.1"),
)
ALLOWED = (
    *("127.0.0.1", "::1", "10.0.0.7", "192.168.1.4", "fd12:3456::7", "169.253.255.255"),
    *("169.255.0.0", "100.100.100.201", "fd00:ec2::255", "2001:1::", "2000:ffff::1", "2003::"),
    *("64:ff9a:ffff:ffff:ffff:ffff:ffff:ffff", "64:ff9b:0:1::", "64:ff9b:2::", "fec0::1"),
    *("2001:4860:4860::8888", "1.1.1.1", "::1:0:0"),
)


def host(address: str) -> str:
    return f"[{address}]" if ":" in address else address


def test_a_forbidden_address_is_refused_as_it_stands_and_by_a_name_that_leads_to_it() -> None:
    for address in FORBIDDEN:
        with pytest.raises(InvalidDocument, match="metadata"):
            check_base_url(f"http://{host(address)}:8000/v1")
        with pytest.raises(InvalidDocument, match=r"models\.example leads to .*metadata"):
            resolve_host("models.example", resolve=leading_to("93.184.216.34", address))


def test_an_address_beside_the_forbidden_ones_passes() -> None:
    for address in ALLOWED:
        check_base_url(f"http://{host(address)}:8000/v1")
        assert resolve_host("models.example", resolve=leading_to(address))
