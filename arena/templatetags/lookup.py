"""A look-up that templates have no words for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from django import template

register = template.Library()

K = TypeVar("K")
V = TypeVar("V")


@register.filter
def at(table: Mapping[K, V], key: K) -> V | None:
    """What the table holds under a key, None if nothing."""
    return table.get(key)
