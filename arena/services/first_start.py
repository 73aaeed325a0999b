"""The first admin of an empty installation, made by whoever started it."""

from __future__ import annotations

from django.contrib.auth.models import Group, User
from django.core import signing
from django.db import transaction

from arena.errors import LinkOver
from arena.queries.people import has_admin
from arena.services.people import create_person

_SALT = "arena.first-start"
LINK_LIVES_S = 24 * 3600


def make_first_link_token() -> str | None:
    """What the first admin's link ends with, None where there is an admin.

    It is signed with the secret key, so that nothing has to be stored; it works for a day, and
    until somebody used it.
    """
    return None if has_admin() else signing.dumps("first admin", salt=_SALT)


def check_first_link(token: str) -> None:
    """Nothing where the link still works.

    Raises:
        LinkOver: It is none of ours, too old, or an admin is there.
    """
    try:
        signing.loads(token, salt=_SALT, max_age=LINK_LIVES_S)
    except signing.BadSignature as error:
        raise LinkOver("This link lets nobody in any more.") from error
    if has_admin():
        raise LinkOver("This link lets nobody in any more.")


@transaction.atomic
def make_first_admin(*, token: str, username: str, password: str) -> User:
    """Make the first admin.

    Raises:
        LinkOver: The link does not work any more.
        InvalidDocument, Conflict: The name can't be taken.
    """
    # Held, so that of two who press the button at once the second one finds an admin.
    Group.objects.get_or_create(name="admin")
    Group.objects.select_for_update(no_key=True).get(name="admin")
    check_first_link(token)
    return create_person(username=username, password=password, role="admin")
