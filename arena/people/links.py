"""Links and tokens: a program's token, an expert's invitation; none is stored readable.

Marks of authorship stand here too: like a link, each joins one expert to one study.
"""

import secrets
from dataclasses import dataclass
from datetime import timedelta

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Case, F, Q, Value, When
from django.urls import reverse
from django.utils import timezone
from django.utils.translation import gettext as _

from arena.errors import LinkOver, NotYours, TokenOver, TooManyRequests
from arena.models import ApiToken, Authorship, Invitation, Study, token_digest
from arena.people.queries import TOKEN_ROLES, effective_role, may_be_let_in, top_role
from arena.people.services import end_links, end_sessions, make_welcome_token
from augment.errors import Conflict, UnknownName
from augment.services.events import log_change
from augment.services.texts import one_line

PREFIX = "arena_"
"""What every token begins with, so that whoever finds one knows what it is."""

DAYS = (1, 7, 30, 90, 365)
"""How long a token may work."""

MOST_ALIVE = 50
"""So many tokens one account may have at once."""

WINDOW = timedelta(minutes=1)
REQUESTS = {"admin": 1200, "researcher": 1200, "expert": 600, "entrant": 600}
"""So many requests a window, by the role of the token; counted in the database, so that it holds
for all web servers together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FreshToken:
    """A token just made; the secret is nowhere else and can't be read again."""

    token: ApiToken
    secret: str


@transaction.atomic
def make_api_token(*, owner: User, name: str, role: str, days: int) -> FreshToken:
    """Create a token for a program that acts for this account.

    Args:
        owner: Whose it is; only they make it.
        name: What it is for.
        role: One of `TOKEN_ROLES` of the owner's role.
        days: How long it works, one of `DAYS`.

    Raises:
        InvalidDocument: The name is empty, too long or not one line.
        UnknownName: The role is none that the owner may give.
        Conflict: It is to work for another time, or the owner has too many.
    """
    name = one_line("name", name, what="token", longest=80)
    offered = TOKEN_ROLES.get(top_role(owner) or "", ())
    if role not in offered:
        raise UnknownName("role", role, list(offered))
    if days not in DAYS:
        problem = _("A token works for %(allowed)s days, not %(n)s.")
        raise Conflict(problem % {"allowed": ", ".join(map(str, DAYS)), "n": days})
    now = timezone.now()
    alive = ApiToken.objects.filter(owner=owner, revoked_at=None, expires_at__gt=now)
    if alive.count() >= MOST_ALIVE:
        problem = _("You have %(n)s tokens already; revoke one of them first.")
        raise Conflict(problem % {"n": MOST_ALIVE})
    secret = PREFIX + secrets.token_urlsafe(32)
    token = ApiToken.objects.create(
        owner=owner,
        name=name,
        role=role,
        token_sha256=token_digest(secret),
        expires_at=now + timedelta(days=days),
    )
    _log_token(token, "add", owner)
    return FreshToken(token=token, secret=secret)


@transaction.atomic
def revoke_api_token(*, token: ApiToken, actor: User | None) -> None:
    """Revoke a token; twice changes nothing."""
    if ApiToken.objects.filter(pk=token.pk, revoked_at=None).update(revoked_at=timezone.now()):
        _log_token(token, "revoke", actor)


def _log_token(token: ApiToken, verb: str, actor: User | None) -> None:
    facts = {"name": token.name, "role": token.role, "owner": str(token.owner.person.code)}
    log_change(token, verb, actor, after=facts | {"expires_at": token.expires_at.isoformat()})


def use_api_token(secret: str) -> tuple[User, ApiToken]:
    """Return the owner of a token, with its role as `token_role`; the request is counted.

    Raises:
        TokenOver: It is nobody's, over, or its owner may do nothing of the kind any more.
        TooManyRequests: More requests than its role has within the window.
    """
    alive = ApiToken.objects.select_related("owner").filter(
        revoked_at=None, expires_at__gt=timezone.now(), owner__is_active=True
    )
    token = alive.filter(token_sha256=token_digest(secret)).first()
    role = None if token is None else effective_role(token.role, top_role(token.owner))
    if token is None or role is None:
        raise TokenOver("This token opens nothing: it is unknown, expired or revoked.")
    _count(token, REQUESTS[role])
    owner = token.owner
    owner.token_role = role  # type: ignore[attr-defined]
    return owner, token


def _count(token: ApiToken, most: int) -> None:
    """Count one request of the window, which begins with the first request after the last one.

    In one statement: of two that come at once in a new window, each finds the other counted.
    """
    now = timezone.now()
    is_new = Q(window_began_at=None) | Q(window_began_at__lte=now - WINDOW)
    free = ApiToken.objects.filter(is_new | Q(window_requests__lt=most), pk=token.pk)
    if not free.update(
        window_requests=Case(When(is_new, then=Value(1)), default=F("window_requests") + 1),
        window_began_at=Case(When(is_new, then=Value(now)), default=F("window_began_at")),
        last_used_at=now,
    ):
        raise TooManyRequests(most, WINDOW.seconds)


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
        known = study.contestants.order_by("slug").values_list("slug", flat=True)
        raise UnknownName("contestant", contestant, list(known))
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
