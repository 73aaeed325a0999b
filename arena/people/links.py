"""Links: an expert's invitation to a study; none is stored readable.

Marks of authorship stand here too: like a link, each joins one expert to one study.
"""

import secrets
from dataclasses import dataclass
from datetime import timedelta

from django.contrib.auth.models import User
from django.db import transaction
from django.urls import reverse
from django.utils import timezone

from arena.api.access import revoke_api_token
from arena.errors import LinkOver, NotYours
from arena.models import ApiToken, Authorship, Invitation, Study, token_digest
from arena.people.queries import may_be_let_in
from arena.people.services import end_links, end_sessions, make_welcome_token
from arena.shell.accounts import top_role
from augment.errors import Conflict, UnknownName
from augment.services import log_change

# --- Invitations -------------------------------------------------------------------------------

LINK_LIVES = timedelta(days=14)

SESSION_KEY = "invitation"
"""Where a session keeps the code of the link that began it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FreshLink:
    """A link just made; the token is nowhere else and can't be read again."""

    invitation: Invitation
    token: str


@transaction.atomic
def make_link_path(user: User, *, study: Study | None = None, actor: User | None = None) -> str:
    """Return the path of a new link that lets the owner of an account in.

    An expert's signs in without a password; anybody else sets a password by theirs. One that leads
    to no study replaces all older ones.

    Raises:
        Conflict, NotYours: See `invite`.
    """
    if study is None and top_role(user) != "expert":
        return reverse("welcome", args=[make_welcome_token(user, actor=actor)])
    if study is None:
        end_links(user)
    return reverse("invitation", args=[invite(study=study, expert=user, actor=actor).token])


@transaction.atomic
def invite(*, study: Study | None, expert: User, actor: User | None = None) -> FreshLink:
    """Make a link that signs this expert in for 14 days; it replaces the one before.

    Who is signed in by the older link stays so; only `revoke` ends that.

    Args:
        study: Where the link leads, while it is open; None leads home.
        expert: Whose link it is.
        actor: Who makes it, for the log.

    Raises:
        NotYours: The account does not take part in the study.
        Conflict: The study was cancelled, or the account can't be let in by a link: it is
            simulated, inactive, or more than an expert.
    """
    if study is not None:
        _must_take_part(study, expert)
        if study.state == Study.State.CANCELLED:
            raise Conflict(f"The study '{study.name}' was cancelled; nobody is invited.")
    if not may_be_let_in(expert):
        raise Conflict(
            f"{expert.get_username()} can't be invited by a link: links are for active "
            "experts who are neither simulated nor researchers or admins."
        )
    # Held, so that of two links made at once the second one sees the first, which it replaces.
    User.objects.select_for_update(no_key=True).get(pk=expert.pk)
    now = timezone.now()
    older = Invitation.objects.select_for_update().filter(
        study=study, expert=expert, revoked_at=None
    )
    replaced = [str(code) for code in older.values_list("code", flat=True)]
    older.update(revoked_at=now)
    token = secrets.token_urlsafe(32)
    row = Invitation.objects.create(
        study=study,
        expert=expert,
        token_sha256=token_digest(token),
        invited_by=actor,
        expires_at=now + LINK_LIVES,
    )
    log_change(row, "invite", actor, before={"replaced": replaced}, after=_facts_about(row))
    return FreshLink(invitation=row, token=token)


def find_invitation(token: str) -> Invitation | None:
    """Return the invitation whose link carries this token, whatever its state."""
    rows = Invitation.objects.select_related("study", "expert__person", "invited_by")
    return rows.filter(token_sha256=token_digest(token)).first()


def lets_in(invitation: Invitation) -> bool:
    """Return whether the link of an invitation works."""
    is_alive = invitation.state(timezone.now()) in Invitation.ALIVE
    return is_alive and may_be_let_in(invitation.expert)


@transaction.atomic
def accept(*, token: str) -> Invitation:
    """Let the expert of a link in; it works until it ends.

    Raises:
        LinkOver: It is nobody's, expired, was taken back, or its account may not be let in.
    """
    Invitation.objects.select_for_update().filter(token_sha256=token_digest(token)).first()
    invitation = find_invitation(token)
    if invitation is None or not lets_in(invitation):
        raise LinkOver("This link lets nobody in any more.")
    if invitation.used_at is None:
        invitation.used_at = timezone.now()
        invitation.save(update_fields=["used_at"])
    log_change(invitation, "accept", invitation.expert)
    return invitation


@transaction.atomic
def revoke(*, invitation: Invitation, actor: User | None = None) -> None:
    """Revoke a link and sign out whoever came in by a link from the same place.

    Tokens of an account without a password are revoked, too: nothing but a link led to them.
    """
    row = Invitation.objects.select_for_update().get(pk=invitation.pk)
    if row.revoked_at is None:
        row.revoked_at = timezone.now()
        row.save(update_fields=["revoked_at"])
    same = Invitation.objects.filter(study=row.study_id, expert=row.expert_id)
    end_sessions(SESSION_KEY, {str(code) for code in same.values_list("code", flat=True)})
    if not row.expert.has_usable_password():
        for token in ApiToken.objects.filter(owner=row.expert, revoked_at=None):
            revoke_api_token(token=token, actor=actor)
    log_change(row, "revoke", actor, after=_facts_about(row))


def _facts_about(row: Invitation) -> dict[str, str | None]:
    study = None if row.study is None else str(row.study.code)
    return {"study": study, "expert": str(row.expert.person.code)}


# --- Authorships -------------------------------------------------------------------------------


@transaction.atomic
def mark_author(
    *,
    study: Study,
    expert: User,
    contestant: str,
    is_author: bool = True,
    actor: User | None = None,
) -> None:
    """Mark an expert as an author of a contestant of the study, or take that back.

    Votes stay as they are; ratings made from then on know of it. Twice changes nothing.

    Args:
        study: Also an open one: experts see nothing of it.
        expert: Takes part in the study.
        contestant: The slug of one of its contestants.
        is_author: False takes the mark back.
        actor: Who says so, for the log.

    Raises:
        NotYours: The account does not take part in the study.
        UnknownName: The study has no such contestant.
    """
    _must_take_part(study, expert)
    row = study.contestants.filter(slug=contestant).first()
    if row is None:
        slugs = study.contestants.order_by("slug").values_list("slug", flat=True)
        raise UnknownName("contestant", contestant, list(slugs))
    marks = Authorship.objects.filter(study=study, expert=expert, contestant=row)
    if is_author:
        _, is_changed = marks.get_or_create(
            study=study, expert=expert, contestant=row, defaults={"marked_by": actor}
        )
    else:
        is_changed = marks.delete()[0] > 0
    if is_changed:
        verb = "mark author" if is_author else "take back author"
        facts = {"expert": str(expert.person.code), "contestant": contestant}
        log_change(study, verb, actor, after=facts)


def _must_take_part(study: Study, expert: User) -> None:
    if not study.experts.filter(pk=expert.pk).exists():
        raise NotYours(f"{expert.get_username()} does not take part in '{study.name}'.")
