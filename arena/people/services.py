"""Accounts: made, let in by a link, paused, given another role; and what each chooses."""

import uuid
from collections.abc import Collection, Mapping
from typing import Any

from django.contrib.auth.models import Group, User
from django.contrib.auth.password_validation import validate_password
from django.contrib.auth.tokens import default_token_generator
from django.contrib.sessions.models import Session
from django.core import signing
from django.core.exceptions import ValidationError
from django.db import IntegrityError, transaction
from django.utils import timezone

from arena.errors import LinkOver
from arena.models import Person
from arena.people.queries import has_admin, is_forgotten
from arena.shell.accounts import ROLES, top_role
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.services import log_change, one_line

LINK_LIVES_S = 24 * 3600
"""How long the first admin's link works."""

SIGNED_IN = "_auth_user_id"
"""Where Django's sessions keep the key of the account."""

OVER = "This link or code lets nobody in, or not any more."
_SALT = "arena.first-start"


@transaction.atomic
def create_person(
    *,
    username: str,
    password: str | None,
    role: str,
    pseudonym: str | None = None,
    is_simulated: bool = False,
    actor: User | None = None,
) -> User:
    """Create an account with a role; an admin may use Django's admin too.

    Args:
        username: For the login.
        password: None for an account without a password.
        role: One of `ROLES`.
        pseudonym: What others see instead of the name; "Expert 3" and so on by default.
        is_simulated: The machine votes for it, and everything that comes of it says so.
        actor: Who creates the account, for the log.

    Raises:
        UnknownName: There is no such role.
        InvalidDocument: The username or the pseudonym is empty, too long or not printable.
        Conflict: The username or the pseudonym is taken.
    """
    _check_role(role)
    try:
        User._meta.get_field("username").clean(username, None)
    except ValidationError as error:
        raise InvalidDocument("person", [("username", " ".join(error.messages))]) from None
    if pseudonym is None:
        pseudonym = _free_pseudonym(role)
    else:
        pseudonym = one_line("pseudonym", pseudonym, what="person", longest=60)
    is_admin = role == "admin"
    try:
        with transaction.atomic():
            user = User.objects.create_user(
                username, password=password, is_staff=is_admin, is_superuser=is_admin
            )
            user.person.pseudonym, user.person.is_simulated = pseudonym, is_simulated
            user.person.save(update_fields=["pseudonym", "is_simulated"])
    except IntegrityError:
        is_name = User.objects.filter(username=username).exists()
        taken = f"username {username!r}" if is_name else f"pseudonym {pseudonym!r}"
        raise Conflict(f"The {taken} is taken.") from None
    user.groups.add(Group.objects.get_or_create(name=role)[0])
    after = {"role": role, "is_simulated": is_simulated}
    log_change(user.person, "add", actor, after=after)
    return user


# --- Links that let an owner in ----------------------------------------------------------------


def make_first_link_token() -> str | None:
    """Return the end of the first admin's link, None where there is an admin.

    It is signed and stored nowhere; it works for a day, until it is used.
    """
    return None if has_admin() else signing.dumps("first admin", salt=_SALT)


def check_first_link(token: str) -> None:
    """Raise LinkOver where the link is forged or too old, or an admin exists."""
    try:
        signing.loads(token, salt=_SALT, max_age=LINK_LIVES_S)
    except signing.BadSignature as error:
        raise LinkOver(OVER) from error
    if has_admin():
        raise LinkOver(OVER)


@transaction.atomic
def make_first_admin(*, code: str, username: str, password: str) -> User:
    """Create the first admin.

    Args:
        code: As `serve` printed it, or the link that ends with it.
        username: For the login.
        password: Not a weak one.

    Raises:
        LinkOver: The code does not work any more.
        InvalidDocument, Conflict: See `create_person`, or the password is too weak.
    """
    _lock_admins()  # so that of two at once the second finds an admin
    check_first_link(end_of_link(code))
    check_password_strength(password, User(username=username))
    return create_person(username=username, password=password, role="admin")


@transaction.atomic
def make_welcome_token(user: User, *, actor: User | None) -> str:
    """Return the end of a link by which somebody sets a password; it works once, for 14 days.

    It is bound to the password and the last login, so that using it ends it. Of an account
    without a password only the newest link works.

    Raises:
        Conflict: The account is paused or simulated.
    """
    if not user.is_active or user.person.is_simulated:
        raise Conflict(f"{user.get_username()} can't sign in.")
    end_links(user)
    log_change(user.person, "make link", actor)
    return f"{user.person.code.hex}-{default_token_generator.make_token(user)}"


def end_of_link(link: str) -> str:
    """Return the token of a link, or of the token alone itself."""
    return link.strip().rstrip("/").rpartition("/")[2]


def find_welcomed(token: str) -> User:
    """Return the account that a link belongs to.

    Raises:
        LinkOver: Nobody's, or it does not work any more.
    """
    code, _sign, rest = token.partition("-")
    try:
        user = User.objects.get(person__code=uuid.UUID(code), is_active=True)
    except (ValueError, User.DoesNotExist):
        raise LinkOver(OVER) from None
    if not default_token_generator.check_token(user, rest):
        raise LinkOver(OVER)
    return user


@transaction.atomic
def accept_welcome(*, token: str, password: str) -> User:
    """Set the password of the account that a link belongs to, which ends the link.

    Raises:
        LinkOver: The link does not work any more.
        InvalidDocument: The password is too weak.
    """
    # Locked, so that of two who use the link at once the second finds it used.
    User.objects.select_for_update().get(pk=find_welcomed(token).pk)
    user = find_welcomed(token)
    check_password_strength(password, user)
    user.set_password(password)
    user.save(update_fields=["password"])
    return user


def check_password_strength(password: str, user: User | None = None) -> None:
    """Raise InvalidDocument for a password that is too weak."""
    try:
        validate_password(password, user)
    except ValidationError as error:
        raise InvalidDocument("person", [("password", " ".join(error.messages))]) from None


def end_links(user: User) -> None:
    """End the invitations of an account, and its welcome links if it has no password."""
    user.invitations.filter(revoked_at=None).update(revoked_at=timezone.now())
    if not user.has_usable_password():
        user.set_unusable_password()  # they are bound to what stands for the password
        user.save(update_fields=["password"])


# --- Changing accounts of others ---------------------------------------------------------------


@transaction.atomic
def set_active(*, user: User, is_active: bool, actor: User) -> None:
    """Pause an account, or resume it; a paused one is signed out everywhere.

    Raises:
        Conflict: It is one's own or forgotten, or the actor is no admin any more.
    """
    check_may_change(user, actor)
    if user.is_active == is_active:
        return
    if is_active and is_forgotten(user):
        raise Conflict("This account is forgotten; nobody can sign in to it again.")
    end_links(user)
    user.is_active = is_active
    user.save(update_fields=["is_active"])
    if not is_active:
        end_sessions(SIGNED_IN, {str(user.pk)})
    log_change(user.person, "resume" if is_active else "pause", actor)


@transaction.atomic
def set_role(*, user: User, role: str, actor: User) -> None:
    """Give an account another role, its only one.

    Raises:
        UnknownName: There is no such role.
        Conflict: It is one's own, or the actor is no admin any more.
    """
    _check_role(role)
    check_may_change(user, actor)
    end_links(user)
    before = {"role": top_role(User.objects.get(pk=user.pk))}
    user.groups.set([Group.objects.get_or_create(name=role)[0]])
    user.is_staff = user.is_superuser = role == "admin"
    user.save(update_fields=["is_staff", "is_superuser"])
    log_change(user.person, "change role", actor, before=before, after={"role": role})


def check_may_change(user: User, actor: User) -> None:
    """Lock the admins, so that one change of accounts ends before the next one begins.

    As the actor stays an admin and changes somebody else, there is always one left.

    Raises:
        Conflict: It is the actor's own account, or the actor is no admin any more.
    """
    if user.pk == actor.pk:
        raise Conflict("This is your own account; ask another admin.")
    _lock_admins()
    if top_role(User.objects.get(pk=actor.pk)) != "admin":
        raise Conflict("You are not an admin any more.")


def end_sessions(name: str, values: Collection[str]) -> None:
    """End the sessions that keep one of the values under a name; they are stored sealed."""
    for session in Session.objects.filter(expire_date__gte=timezone.now()):
        if session.get_decoded().get(name) in values:
            session.delete()


# --- What a person chooses ---------------------------------------------------------------------


@transaction.atomic
def keep_preference(user: User, **chosen: Any) -> Person:
    """Keep preferences by name; an account without a person gets one."""
    person, _is_new = Person.objects.select_for_update().get_or_create(
        user=user, defaults={"pseudonym": user.get_username()}
    )
    person.preferences = {**person.preferences, **chosen}
    person.save(update_fields=["preferences"])
    return person


@transaction.atomic
def keep_voting(user: User, switches: Mapping[str, bool]) -> None:
    """Keep how this account votes; what is not named stays as it was."""
    person = keep_preference(user)
    keep_preference(user, voting={**person.preferences.get("voting", {}), **switches})


def _check_role(role: str) -> None:
    if role not in ROLES:
        raise UnknownName("role", role, list(ROLES))


def _free_pseudonym(role: str) -> str:
    number = Person.objects.filter(user__groups__name=role).count() + 1
    while Person.objects.filter(pseudonym=f"{role.capitalize()} {number}").exists():
        number += 1
    return f"{role.capitalize()} {number}"


def _lock_admins() -> None:
    Group.objects.get_or_create(name="admin")
    Group.objects.select_for_update(no_key=True).get(name="admin")
