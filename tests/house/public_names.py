"""The names that users' links, scripts, programs and stored files hold.

`public_names.txt` lists those of 2026-11-25 (744dfde7), but for what features.md calls dropped.
"""

import re
from argparse import ArgumentParser, _SubParsersAction
from collections.abc import Iterator
from typing import Any

from django.apps import apps
from django.core.management import get_commands, load_command_class
from django.core.management.base import DjangoHelpFormatter
from django.urls import URLPattern, URLResolver, get_resolver
from drf_spectacular.generators import SchemaGenerator

from augment.simulation.planners import NAMED
from tests.house.source import PRODUCT

DJANGOS = {"--help", *DjangoHelpFormatter.show_last}


def public_names() -> Iterator[tuple[str, str]]:
    """Pairs of an owner, as `command export`, and one of its names, as `--out`."""
    yield from (("addresses", address) for address in _addresses(get_resolver()))
    yield from (("planners", name) for name in NAMED)
    for command, app in get_commands().items():
        if str(app).startswith(PRODUCT):
            parser = load_command_class(app, command).create_parser("", command)
            yield from _options(parser, f"command {command}")
    for model in apps.get_models():
        if model._meta.app_label in PRODUCT:
            for field in model._meta.fields:
                owner = f"values {model._meta.label_lower}.{field.name}"
                yield from ((owner, str(value)) for value, _ in field.choices or ())
    yield from _api()


def _addresses(resolver: URLResolver, before: str = "") -> Iterator[str]:
    for pattern in resolver.url_patterns:
        address = before + str(pattern.pattern)
        if isinstance(pattern, URLPattern):
            yield re.sub(r"<(?:\w+:)?\w+>", "<>", address) or "/"
        else:
            yield from _addresses(pattern, address)


def _options(parser: ArgumentParser, owner: str) -> Iterator[tuple[str, str]]:
    yield owner, "-h"
    for action in parser._actions:
        if isinstance(action, _SubParsersAction):
            for kind, parser_of_kind in action.choices.items():
                yield from _options(parser_of_kind, f"{owner} {kind}")
        names = set(action.option_strings)
        yield from (
            (owner, name) for name in names if name.startswith("--") and name not in DJANGOS
        )


def _api() -> Iterator[tuple[str, str]]:
    generator: Any = SchemaGenerator
    document = generator().get_schema(request=None, public=True)
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            owner = f"api {method} {re.sub('{.*?}', '{}', path)}"
            contents = {"body": operation.get("requestBody", {}).get("content", {})}
            for status, answer in operation["responses"].items():
                contents["answer" if status < "400" else "error"] = answer.get("content", {})
            yield owner, "-"
            for parameter in operation.get("parameters", []):
                if parameter["in"] != "path":
                    yield owner, parameter["name"]
            for part, content in contents.items():
                for kind in content.values():
                    fields = _fields(kind.get("schema", {}), document["components"]["schemas"], ())
                    yield from ((f"{owner} {part}", field) for field in fields)


def _fields(
    schema: dict[str, Any], components: dict[str, Any], within: tuple[str, ...]
) -> Iterator[str]:
    """Yield the paths of all properties, as `contestants.slug`."""
    if reference := schema.get("$ref"):
        if reference not in within:
            component = components[reference.rpartition("/")[2]]
            yield from _fields(component, components, (*within, reference))
        return
    for name, value in schema.get("properties", {}).items():
        yield name
        yield from (f"{name}.{field}" for field in _fields(value, components, within))
    parts = [schema[key] for key in ("items",) if key in schema]
    for part in (
        *parts,
        *(each for key in ("allOf", "oneOf", "anyOf") for each in schema.get(key, ())),
    ):
        yield from _fields(part, components, within)
