from __future__ import annotations

import socket
from pathlib import Path

import pytest
from django.conf import settings

from arena.serving.stack import Web, remembered_address, served_address


def test_the_address_is_known_while_the_server_answers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(settings, "VAR_DIR", tmp_path / "var")
    assert served_address() is None
    with socket.create_server(("127.0.0.1", 0)) as server:
        web = Web(port=server.getsockname()[1])
        with remembered_address(web):
            assert served_address() == web.address
        assert served_address() is None
    with remembered_address(web):
        assert served_address() is None, "a file that a killed server left says nothing"
