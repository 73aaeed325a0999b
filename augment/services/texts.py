"""Texts from outside as every database takes them, slugs, and names of stored files."""

import re
from itertools import chain, count
from typing import Any
from uuid import UUID

from django.db.models import Manager
from django.utils.text import slugify

from augment.errors import InvalidDocument
from augment.scene.planned_motion import MOTION


def make_storable(text: str) -> str:
    """Return the text as every database stores it: without NUL and lone surrogates."""
    return text.replace("\0", "\u2400").encode("utf-8", "backslashreplace").decode("utf-8")


def make_document_storable(value: Any) -> Any:
    """Return the JSON document with each of its texts storable."""
    if isinstance(value, str):
        return make_storable(value)
    if isinstance(value, dict):
        return {make_storable(key): make_document_storable(item) for key, item in value.items()}
    if isinstance(value, list):
        return [make_document_storable(item) for item in value]
    return value


def motion_in_words(agent: dict[str, Any]) -> str:
    """Return the motion of a stored modification's agent in words; empty if it has none."""
    return str(MOTION.shape.validate_python(agent["motion"])) if "motion" in agent else ""


LONGEST_REASON = 2_000
"""Characters of a reason for failure; the whole of what was said is in the calls."""

LONGEST_NOTES = 20_000
"""Characters of a contestant's notes about its own work."""


_BETWEEN_SIGNS = re.compile("[ \u00a0\u1680\u2000-\u200a\u200c\u200d\u202f\u205f\u3000]")


def one_line(field: str, value: str, *, what: str, longest: int = 120) -> str:
    """Return a name that people read, without blanks around it.

    Args:
        field: Which name, for the error.
        value: What was given.
        what: The kind of thing that bears the name.
        longest: How many characters its column takes.

    Raises:
        InvalidDocument: It is empty, too long, or has a character that does not print.
    """
    value = value.strip()
    if not 0 < len(value) <= longest or not is_readable_line(value):
        rule = f"1 to {longest} printable characters are needed"
        raise InvalidDocument(what, [(field, rule)])
    return value


def is_readable_line(text: str) -> bool:
    """Return whether the text prints on one line.

    Python counts neither joiners as printable, which spell names in Persian or Malayalam, nor any
    space but one.
    """
    seen = _BETWEEN_SIGNS.sub("", text)
    return bool(seen) and seen.isprintable()


def check_prose(field: str, value: str, *, what: str, longest: int) -> None:
    """Refuse a text of several lines that can't be stored and shown.

    Raises:
        InvalidDocument: It is empty, too long, or holds NUL or half a character.
    """
    if not value.strip():
        raise InvalidDocument(what, [(field, "is empty")])
    if len(value) > longest:
        rule = f"{len(value)} characters are too many, at most {longest} are allowed"
        raise InvalidDocument(what, [(field, rule)])
    if make_storable(value) != value:
        raise InvalidDocument(what, [(field, "holds signs that no database takes")])


# --- Slugs: short names in files and addresses ---------------------------------------------------

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


def read_code(text: str) -> UUID:
    """Return the code of a row; for any other text one that no row has."""
    try:
        return UUID(text)
    except ValueError:
        return UUID(int=0)


# --- Names of stored files -----------------------------------------------------------------------

_DIGEST = "[0-9a-f]{16,64}"
_CODE = "[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
_PICTURE = re.compile(rf"bev/(?:[0-9a-z-]+/)?{_DIGEST}\.png")
_STORED = re.compile(
    rf"(?:asked|marked|references)/{_DIGEST}\.png|prompts/{_DIGEST}\.(?:png|json)"
    rf"|scenes/{_DIGEST}-[0-9a-f-]+-(?:kept|cleared|backdrop)\.png"
    rf"|bev/[0-9a-z-]+-film/{_DIGEST}\.json|references/[0-9a-z-]+-film/{_DIGEST}\.(?:png|json)"
    rf"|previews/{_CODE}\.png|uploads/{_CODE}(?:_[A-Za-z0-9]{{7}})?"
)


def is_stored_name(name: str) -> bool:
    """Return whether a file of this name may lie in the media storage and in a backup."""
    return bool(_PICTURE.fullmatch(name) or _STORED.fullmatch(name))


def check_picture_name(field: str, name: str) -> None:
    """Refuse what can't be the name of a picture of a scene; empty is no picture.

    Raises:
        InvalidDocument: It lies in another folder, or is not named by the hash of its content.
    """
    if name and not _PICTURE.fullmatch(name):
        rule = f"{name!r} must be bev/WINDOW/SHA256.png or bev/SHA256.png"
        raise InvalidDocument("picture", [(field, rule)])


def check_stored_name(field: str, name: str) -> None:
    """Refuse what can't be the name of any file of ours; empty is none.

    Raises:
        InvalidDocument: It is none.
    """
    if name and not is_stored_name(name):
        raise InvalidDocument("file", [(field, f"{name!r} is no name of a file of ours")])
