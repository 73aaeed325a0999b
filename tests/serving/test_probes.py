from __future__ import annotations

import socket
from pathlib import Path

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from arena.serving import redis_server
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


def test_without_any_redis_server_the_error_says_how_to_get_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(redis_server, "find_spec", lambda name: None)
    with pytest.raises(redis_server.NoRedisServer, match="apt install redis-server"):
        redis_server.find_redis_server()


@pytest.mark.parametrize("name", ["redis-server", "valkey-server"])
def test_what_speaks_redis_is_found_by_either_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / name
    program.write_text("#!/bin/sh\n")
    program.chmod(0o700)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert redis_server.find_redis_server() == program


@pytest.mark.parametrize("port", [-1, 0, 65_536])
def test_a_number_that_is_no_port_is_refused(port: int) -> None:
    with pytest.raises(PortTaken, match=f"A port goes from 1 to 65535, not {port}"):
        require_free_port("127.0.0.1", port)


@pytest.mark.parametrize("option", ["--web-workers", "--concurrency"])
def test_at_least_one_of_each_is_needed(option: str) -> None:
    with pytest.raises(CommandError, match=f"argument {option}: 1 or more is needed, not 0"):
        call_command("serve", option, "0")
