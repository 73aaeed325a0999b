"""What an admin does with the accounts of others: links, pauses, roles, forgetting."""

from __future__ import annotations

import uuid

from axes.models import AccessAttempt, AccessFailureLog, AccessLog
from django.contrib.auth.models import Group, User
from django.contrib.auth.password_validation import validate_password
from django.contrib.auth.tokens import default_token_generator
from django.contrib.sessions.models import Session
from django.core.exceptions import ValidationError
from django.db import transaction
from django.utils import timezone

from arena.errors import LinkOver
from arena.models import EnrolledVoter, Invitation, Person, Study
from arena.queries.people import ROLES, forgotten_name, has_admin, is_forgotten, role_of
from arena.services.enrolments import give_up_places
from arena.services.study_drafts import rename_in_drafts
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.services.events import log_event


@transaction.atomic
def make_welcome_token(user: User, *, actor: User) -> str:
    """What a link ends with by which somebody sets a password; it works once, for 14 days.

    It is bound to the password and the last login, so that using it ends it. The newest link of
    an account without a password is the only one that works.

    Raises:
        Conflict: The account is paused or simulated.
    """
    if not user.is_active or user.person.is_simulated:
        raise Conflict(f"{user.get_username()} can't sign in.")
    _end_links(user)
    _log(user, actor, "make link", None, None)
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
def accept_welcome(*, token: str, password: str) -> User:
    """Set the password of the account that a link belongs to, which ends the link.

    Raises:
        LinkOver: The link does not work any more.
        InvalidDocument: The password is too weak; the text says why.
    """
    user = find_welcomed(token)
    # Held, so that of two who use the link at once the second one finds it used.
    User.objects.select_for_update().get(pk=user.pk)
    user = find_welcomed(token)
    check_password_strength(password, user)
    user.set_password(password)
    user.save(update_fields=["password"])
    return user


def check_password_strength(password: str, user: User | None = None) -> None:
    """Do nothing for a password that may be set.

    Raises:
        InvalidDocument: It is too weak; the text says why.
    """
    try:
        validate_password(password, user)
    except ValidationError as error:
        raise InvalidDocument("person", [("password", " ".join(error.messages))]) from None


@transaction.atomic
def set_active(*, user: User, is_active: bool, actor: User) -> None:
    """Pause an account, or let it go on; a paused one is signed out everywhere.

    Raises:
        Conflict: It is one's own or forgotten, or the actor administrates no more.
    """
    _must_be_another(user, actor)
    _hold_admins(actor)
    if user.is_active == is_active:
        return
    if is_active and is_forgotten(user):
        raise Conflict("This account is forgotten; nobody can sign in to it again.")
    _end_links(user)
    user.is_active = is_active
    user.save(update_fields=["is_active"])
    if not is_active:
        _sign_out(user)
    _keep_an_admin()
    _log(user, actor, "resume" if is_active else "pause", None, None)


@transaction.atomic
def set_role(*, user: User, role: str, actor: User) -> None:
    """Give an account another role; it has no other beside it.

    Raises:
        UnknownName: There is no such role.
        Conflict: It is one's own, or the actor administrates no more.
    """
    if role not in ROLES:
        raise UnknownName("role", role, list(ROLES))
    _must_be_another(user, actor)
    _hold_admins(actor)
    _end_links(user)
    before = role_of(User.objects.get(pk=user.pk))
    user.groups.set([Group.objects.get_or_create(name=role)[0]])
    user.is_staff = user.is_superuser = role == "admin"
    user.save(update_fields=["is_staff", "is_superuser"])
    _keep_an_admin()
    _log(user, actor, "change role", {"role": before}, {"role": role})


@transaction.atomic
def forget_identity(*, user: User, actor: User) -> None:
    """Take name, address and pseudonym from an account; its votes stay. There is no way back.

    Who came by an enrolment link and is not done loses the place, as nobody can sign in any more.
    Ratings that are frozen keep the pseudonym that stood there when they were made.

    Raises:
        Conflict: It is one's own, or the actor administrates no more.
    """
    _must_be_another(user, actor)
    _hold_admins(actor)
    known_as, name = user.get_username(), forgotten_name(user.person)
    User.objects.filter(pk=user.pk).update(
        username=name, first_name="", last_name="", email="", is_active=False, last_login=None
    )
    user.refresh_from_db()
    user.set_unusable_password()
    user.save(update_fields=["password"])
    Person.objects.filter(user=user).update(pseudonym=f"Former person {name[5:]}", preferences={})
    Invitation.objects.filter(expert=user, revoked_at=None).update(revoked_at=timezone.now())
    _rename_in_plans(known_as, name)  # holds the studies, which comes before what is in them
    give_up_places(expert=user, actor=actor)
    EnrolledVoter.objects.filter(expert=user).update(external_id="")
    rename_in_drafts(known_as, name)
    for failures in (AccessAttempt, AccessFailureLog, AccessLog):
        failures.objects.filter(username=known_as).delete()
    _sign_out(user)
    _keep_an_admin()
    _log(user, actor, "forget identity", None, None)


def _rename_in_plans(known_as: str, name: str) -> None:
    """Studies keep in their rules whom they were planned for, by name."""
    for study in Study.objects.select_for_update().order_by("pk"):
        experts = study.rules.get("experts", [])
        if known_as not in experts and known_as not in study.votes_to_plan:
            continue
        named = {known_as: name}
        if experts:
            study.rules["experts"] = [named.get(one, one) for one in experts]
        study.votes_to_plan = {
            named.get(one, one): votes for one, votes in study.votes_to_plan.items()
        }
        study.save(update_fields=["rules", "votes_to_plan"])


def _hold_admins(actor: User) -> None:
    """Let one change of accounts end before the next one begins.

    Else two admins who demote each other at once would leave none.

    Raises:
        Conflict: The actor is an admin no more.
    """
    Group.objects.get_or_create(name="admin")
    Group.objects.select_for_update(no_key=True).get(name="admin")
    if role_of(User.objects.get(pk=actor.pk)) != "admin":
        raise Conflict("You are not an admin any more.")


def _keep_an_admin() -> None:
    if not has_admin():
        raise Conflict("Nobody would be left to administrate.")


def _end_links(user: User) -> None:
    """End the links of an account without a password; they are bound to what stands for it."""
    if not user.has_usable_password():
        user.set_unusable_password()
        user.save(update_fields=["password"])


def _must_be_another(user: User, actor: User) -> None:
    if user.pk == actor.pk:
        raise Conflict("This is your own account; ask another admin.")


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
