"""docs/features.md lists what the code offers, and nothing else."""

import re
from argparse import _SubParsersAction
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from django.core.management import get_commands, load_command_class
from django.urls import URLPattern, URLResolver, get_resolver

from arena.config.env import Environment
from augment.formats.readers import READERS
from augment.formats.writers import WRITERS
from tests.house.source import PRODUCT, ROOT

READ_BY_BOTO3 = {"AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"}
API = "api/v1/"


def listed(section: str) -> set[str]:
    """The names of features, from the tables of a section."""
    text = (ROOT / "docs" / "features.md").read_text()
    (part,) = re.findall(rf"^## {section}\n(.*?)(?=^## |\Z)", text, re.M | re.S)
    rows = re.findall(r"^\| (`.*?) \|", part, re.M)
    names = [name for row in rows for name in re.findall(r"`([^`]+)`", row)]
    assert section == "File formats" or len(names) == len(set(names))
    return set(names)


def addresses(resolver: URLResolver, before: str = "") -> Iterator[tuple[str, URLPattern]]:
    """Every address with its pattern."""
    for pattern in resolver.url_patterns:
        address = before + str(pattern.pattern)
        if isinstance(pattern, URLPattern):
            yield address, pattern
        else:
            yield from addresses(pattern, address)


def pages() -> set[str]:
    found = addresses(get_resolver())
    return {pattern.name or address for address, pattern in found if not address.startswith(API)}


def operations() -> set[str]:
    """`POST jobs/{code}/pause` and its like; what is no view of the API answers pages."""
    found = set()
    for address, pattern in addresses(get_resolver()):
        view: Any = getattr(pattern.callback, "cls", None)
        if not address.startswith(API) or view is None:
            continue
        path = re.sub(r"<(?:\w+:)?(\w+)>", r"{\1}", address.removeprefix(API))
        methods = getattr(pattern.callback, "actions", None) or {
            method for method in view.http_method_names if hasattr(view, method)
        }
        found |= {
            f"{method.upper()} {path}" for method in methods if method not in ("head", "options")
        }
    return found


def commands() -> set[str]:
    return {name for name, app in get_commands().items() if str(app).startswith(PRODUCT)}


def settings_read() -> set[str]:
    return READ_BY_BOTO3 | Environment.model_fields.keys()


def formats() -> set[str]:
    """Formats of scenes and scenarios, and the kinds of `manage.py export`."""
    parser = load_command_class(get_commands()["export"], "export").create_parser("", "export")
    (kinds,) = (one for one in parser._actions if isinstance(one, _SubParsersAction))
    return {*READERS, *WRITERS, *kinds.choices}


OFFERED: dict[str, Callable[[], set[str]]] = {
    "Pages": pages,
    "Commands": commands,
    "Settings": settings_read,
    "File formats": formats,
}


@pytest.mark.parametrize("section", OFFERED)
def test_what_is_offered_is_listed_and_nothing_else(section: str) -> None:
    assert len(listed(section)) >= 10
    assert listed(section) == OFFERED[section]()


def test_the_page_on_the_api_lists_every_operation() -> None:
    page = (ROOT / "docs" / "api.md").read_text()
    rows = re.findall(r"^\| (`/.*?) \| ?(.*?) \| ?(.*?) ?\|$", page, re.M)
    explained = {
        f"{method} {address}"
        for addresses, *cells in rows
        for method, cell in zip(("GET", "POST"), cells, strict=True)
        for address in re.findall(r"`/([^`]+)`", addresses)
        if cell
    }
    assert explained == operations()


def test_the_page_on_deploying_explains_every_setting() -> None:
    page = (ROOT / "docs" / "deploying.md").read_text()
    explained = {
        name
        for names in re.findall(r"^\| (`[A-Z].*?) \|", page, re.M)
        for name in re.findall(r"`([A-Z_]+)`", names)
    }
    assert explained == listed("Settings")
