"""Asking the API as an expert does, and reading its errors."""

import uuid
from typing import Any

from django.contrib.auth.models import User
from django.test import Client


def signed_in(username: str) -> Client:
    client = Client()
    client.force_login(User.objects.get(username=username))
    return client


def post(client: Client, body: object) -> Any:
    return client.post("/api/v1/votes", body, content_type="application/json")


def body_for(given: Any, letter: str = "A", **more: object) -> dict[str, object]:
    return {"key": str(uuid.uuid4()), "matchup": str(given.code), "outcome": letter, **more}


def error_of(response: Any, status: int, code: str) -> dict[str, Any]:
    """The one shape of every error."""
    assert response.status_code == status, response.content
    assert list(response.json()) == ["error"]
    error: dict[str, Any] = response.json()["error"]
    assert error["code"] == code
    assert error["message"]
    return error
