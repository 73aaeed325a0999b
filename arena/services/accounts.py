"""What an admin does with the accounts of others: links, pauses, roles, forgetting."""

from __future__ import annotations

import uuid

from django.contrib.auth.models import Group, User
from django.contrib.auth.tokens import default_token_generator
from django.contrib.sessions.models import Session
from django.db import transaction
from django.utils import timezone

from arena.errors import LinkOver
from arena.models import Invitation, Person
from arena.queries.people import ROLES, role_of
from augment.errors import Conflict, UnknownName
from augment.sentences import sentence
from augment.services.events import log_event


def make_welcome_token(user: User) -> str:
    """What a link ends with by which somebody sets a password; it works once, for 14 days.

    It is bound to the password and the last login, so that using it ends it.

    Raises:
        Conflict: The account is paused or simulated.
    """
    if not user.is_active or user.person.is_simulated:
        raise Conflict(sentence("%(name)s can't sign in.", name=user.get_username()))
    return f"{user.person.code.hex}-{default_token_generator.make_token(user)}"


def find_welcomed(token: str) -> User:
    """Whose link it is.

    Raises:
        LinkOver: Nobody's, or it does not work any more.
    """
    code, _, rest = token.partition("-")
    try:
        person = Person.objects.select_related("user").get(code=uuid.UUID(code))
    except (ValueError, Person.DoesNotExist):
        person = None
    if person is None or not person.user.is_active:
        raise LinkOver("This link lets nobody in any more.")
    if not default_token_generator.check_token(person.user, rest):
        raise LinkOver("This link lets nobody in any more.")
    return person.user


@transaction.atomic
def set_active(*, user: User, is_active: bool, actor: User) -> None:
    """Pause an account, or let it go on; a paused one is signed out everywhere.

    Raises:
        Conflict: It is one's own.
    """
    _must_be_another(user, actor)
    if user.is_active == is_active:
        return
    user.is_active = is_active
    user.save(update_fields=["is_active"])
    if not is_active:
        _sign_out(user)
    _log(user, actor, "resume" if is_active else "pause", None, None)


@transaction.atomic
def set_role(*, user: User, role: str, actor: User) -> None:
    """Give an account another role; it has no other beside it.

    Raises:
        UnknownName: There is no such role.
        Conflict: It is one's own.
    """
    if role not in ROLES:
        raise UnknownName("role", role, list(ROLES))
    _must_be_another(user, actor)
    before = role_of(User.objects.get(pk=user.pk))
    user.groups.set([Group.objects.get_or_create(name=role)[0]])
    user.is_staff = user.is_superuser = role == "admin"
    user.save(update_fields=["is_staff", "is_superuser"])
    _log(user, actor, "change role", {"role": before}, {"role": role})


@transaction.atomic
def forget_identity(*, user: User, actor: User) -> None:
    """Take name, address and pseudonym from an account; its votes stay. There is no way back.

    Ratings that are frozen keep the pseudonym that stood there when they were made.

    Raises:
        Conflict: It is one's own.
    """
    _must_be_another(user, actor)
    name = f"gone-{user.person.code.hex[:12]}"
    User.objects.filter(pk=user.pk).update(
        username=name, first_name="", last_name="", email="", is_active=False, last_login=None
    )
    user.refresh_from_db()
    user.set_unusable_password()
    user.save(update_fields=["password"])
    Person.objects.filter(user=user).update(pseudonym=f"Former person {name[5:]}", preferences={})
    Invitation.objects.filter(expert=user, revoked_at=None).update(revoked_at=timezone.now())
    _sign_out(user)
    _log(user, actor, "forget identity", None, None)


def _must_be_another(user: User, actor: User) -> None:
    if user.pk == actor.pk:
        raise Conflict(sentence("This is your own account; ask another admin."))


def _sign_out(user: User) -> None:
    """End its sessions; they are read one by one, because they are stored sealed."""
    for session in Session.objects.filter(expire_date__gte=timezone.now()).iterator():
        if session.get_decoded().get("_auth_user_id") == str(user.pk):
            session.delete()


def _log(
    user: User,
    actor: User,
    verb: str,
    before: dict[str, object] | None,
    after: dict[str, object] | None,
) -> None:
    log_event(
        actor=actor,
        verb=verb,
        object_kind="person",
        object_code=user.person.code,
        before=before,
        after=after,
    )
