"""Names under which files are kept in the media storage; no other name is taken from outside."""

from __future__ import annotations

import re

from augment.errors import InvalidDocument

_DIGEST = "[0-9a-f]{16,64}"
_CODE = "[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
_PICTURE = re.compile(rf"bev/(?:[0-9a-z-]+/)?{_DIGEST}\.png")
_STORED = re.compile(
    rf"(?:asked|marked|references)/{_DIGEST}\.png|prompts/{_DIGEST}\.(?:png|json)"
    rf"|scenes/{_DIGEST}-[0-9a-f-]+-(?:kept|cleared|backdrop)\.png"
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
