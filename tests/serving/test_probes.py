import socket
from pathlib import Path

import pytest

from arena.serving import probes
from arena.serving.probes import PortTaken, port_answers, redis_answers, require_free_port


def test_a_taken_port_is_named_with_the_next_one() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert port_answers("127.0.0.1", port)
        with pytest.raises(PortTaken, match=rf"Port {port} .* --port {port + 1}"):
            require_free_port("127.0.0.1", port)
    assert not port_answers("127.0.0.1", port)


def test_an_address_of_another_computer_is_refused() -> None:
    with pytest.raises(PortTaken, match=r"192\.0\.2\.1"):
        require_free_port("192.0.2.1", 8000)


def test_no_redis_answers_where_there_is_none(tmp_path: Path) -> None:
    assert not redis_answers(tmp_path / "redis.sock")
    (tmp_path / "redis.sock").touch()
    assert not redis_answers(tmp_path / "redis.sock")


@pytest.mark.parametrize("name", ["redis-server", "valkey-server"])
def test_what_speaks_redis_is_found_by_either_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / name
    program.write_text("#!/bin/sh\n")
    program.chmod(0o700)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert probes.find_redis_server() == program
