"""Slugs: short names in files and addresses, checked, or made of a name in any script."""

import re
from itertools import chain, count
from typing import Any

from django.db.models import Manager
from django.utils.text import slugify

from augment.errors import InvalidDocument

SLUG_LENGTH = 80
SLUG_RULE = "Lower-case letters, digits, hyphens. Empty: made of the name."


def check_slug(slug: str, *, what: str, key: str = "slug") -> None:
    """Raise unless a slug can be stored.

    Raises:
        InvalidDocument: It has other characters, or is too long.
    """
    if len(slug) > SLUG_LENGTH or not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", slug):
        rule = f"lower-case letters, digits and single hyphens, at most {SLUG_LENGTH}"
        raise InvalidDocument(what, [(key, f"{slug!r} must be {rule}")])


def make_slug(name: str) -> str:
    """Return a name as a slug: without accents and whatever is not of the Latin script."""
    return slugify(re.sub(r"[\W_]+", "-", name))[: SLUG_LENGTH - 8].strip("-")


def free_slug(
    rows: Manager[Any], name: str, *, otherwise: str, column: str = "slug", starts_at: int = 0
) -> str:
    """Return a slug made of a name that none of the rows has, with a number where it is taken.

    Args:
        rows: Of which it is to be unique.
        name: As people call it.
        otherwise: What stands for a name of which `make_slug` leaves nothing.
        column: Where the rows have theirs.
        starts_at: The first number; 0 for none as long as it is free without one.
    """
    stem = make_slug(name) or otherwise
    taken = set(rows.filter(**{f"{column}__startswith": stem}).values_list(column, flat=True))
    numbered = (f"{stem}-{number}" for number in count(starts_at or 2))
    return next(slug for slug in chain([] if starts_at else [stem], numbered) if slug not in taken)
