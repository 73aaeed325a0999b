"""Experts of a study: progress, authors, links to invite and to enrol; forgetting somebody."""

import uuid
from typing import Any

from django import forms
from django.contrib import messages
from django.contrib.auth import login
from django.contrib.auth.decorators import login_not_required
from django.core import signing
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils import timezone
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.errors import EnrolmentOver, LinkOver, NotYours
from arena.exports.cells import csv_text
from arena.models import Authorship, EnrolledVoter, Enrolment, Invitation, Study
from arena.people import links
from arena.people.pages import find_account, with_own_language
from arena.people.queries import by_pseudonym, invitation_by_token, may_be_let_in
from arena.site.access import ADMIN, BACKEND, GONE, allow_only, keep_secret, user_of
from arena.site.acts import Confirmation, ask, is_sure, refusals_in, refusals_told, tell_errors
from arena.site.forms import offer
from arena.site.listing import read_page
from arena.studies.queries import (
    authorships_of,
    code_told,
    enrolled_voters,
    enrolment_by_token,
    expert_lines,
    state_of,
)
from arena.studies.services.taking_part import (
    LONGEST_CONSENT,
    LONGEST_ID,
    drop_silent,
    enrol,
    forget_identity,
    set_enrolment,
)

SESSION_S = 30 * 24 * 3600
LINK_COOKIE, VOTER_COOKIE, ENROLMENT_COOKIE = "arena_link", "arena_voter", "arena_enrolment"
RETURN_S = 365 * 24 * 3600
"""How long a browser knows who enrolled in it; its session ends before."""

PAGE = 100
ID_PARAMETERS = ("id", "worker", "workerId", "PROLIFIC_PID")
"""In an address, what the platforms call the id of whom they send."""

COLUMNS = (
    *("voter", "id", "planned", "answered", "skipped"),
    *("enrolled_at", "last_vote_at", "dropped_at", "is_done", "completion_code"),
)
CONSENT = (
    "I take part of my own free will and may stop at any time. My answers, the time that they "
    "took and the id that I enter are kept to evaluate this study; the id is published nowhere."
)


class AuthorForm(forms.Form):
    """Which expert of the study made which of its contestants."""

    expert = forms.ChoiceField(error_messages={"required": "Choose an expert."})
    contestant = forms.ChoiceField(error_messages={"required": "Choose a contestant."})

    def __init__(self, data: dict[str, Any] | None = None, *, study: Study) -> None:
        super().__init__(data)
        experts = by_pseudonym(study.experts.select_related("person"))
        self.accounts = {str(user.person.code): user for user in experts}
        named = [
            (code, f"{user.person.pseudonym} ({user.get_username()})")
            for code, user in self.accounts.items()
        ]
        made = study.contestants.order_by("name", "slug").values_list("slug", "name")
        for name, offered in (("expert", named), ("contestant", [*made])):
            offer(self, name, [("", "Choose …"), *offered])
            self.fields[name].widget.attrs["class"] = "input"


class EnrolmentForm(forms.Form):
    """The rules of an enrolment link."""

    consent = forms.CharField(max_length=LONGEST_CONSENT, initial=CONSENT)
    asks_for = forms.CharField(max_length=120, initial="Your name or worker ID")
    places = forms.IntegerField(min_value=1, max_value=100_000, initial=100)
    votes_each = forms.IntegerField(min_value=1, max_value=10_000, initial=30)
    drop_out_after_h = forms.IntegerField(
        min_value=1, max_value=10_000, required=False, initial=24
    )
    is_open = forms.BooleanField(required=False, initial=True)


class NewcomerForm(forms.Form):
    """What somebody enters who takes part."""

    external_id = forms.CharField(
        max_length=LONGEST_ID, error_messages={"required": gettext_lazy("Please enter it.")}
    )
    agreed = forms.BooleanField(
        error_messages={"required": gettext_lazy("You take part only if you agree.")}
    )
    agreed_sha256 = forms.CharField(max_length=64)

    def clean_external_id(self) -> str:
        """Return the id if it can be shown on one line."""
        text: str = self.cleaned_data["external_id"]
        if not text.isprintable():
            wanted = _("1 to %(most)s printable characters are needed.")
            raise forms.ValidationError(wanted % {"most": LONGEST_ID})
        return text


# --- The experts of a study --------------------------------------------------------------------


@allow_only(ADMIN)
@never_cache
@require_safe
def experts_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Every expert of a study: progress, pace, quota, last seen, link, and who is an author."""
    study = get_object_or_404(Study, code=code)
    lines = expert_lines(study, timezone.now())
    context = {
        "study": study,
        "lines": lines,
        "without_link": sum(line.may_be_invited and not line.has_live_link for line in lines),
        "authorships": authorships_of(study),
        "author_form": AuthorForm(study=study),
    }
    return render(request, "studies/experts.html", context)


@allow_only(ADMIN)
@require_POST
def mark(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Mark an expert as author of a contestant, be the study open or closed."""
    study = get_object_or_404(Study, code=code)
    form = AuthorForm(request.POST, study=study)
    if not form.is_valid():
        tell_errors(request, form)
        return redirect("experts", code=code)
    expert, contestant = form.cleaned_data["expert"], form.cleaned_data["contestant"]
    with refusals_told(request):
        row = links.mark_author(
            study=study,
            expert=form.accounts[expert],
            contestant=contestant,
            actor=user_of(request),
        )
        messages.success(request, f"{_named(row)} is marked as author of {row.contestant.name}.")
    return redirect("experts", code=code)


@allow_only(ADMIN)
@require_POST
def take_back(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Remove one mark of authorship; it stays in the log."""
    rows = Authorship.objects.select_related("study", "expert__person", "contestant")
    row = get_object_or_404(rows, code=code)
    links.take_back_author(authorship=row, actor=user_of(request))
    done = f"{_named(row)} is not marked as author of {row.contestant.name} any more."
    messages.success(request, done)
    return redirect("experts", code=row.study.code)


def _named(row: Authorship | Invitation) -> str:
    return row.expert.person.pseudonym


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def forget_person(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Remove the identity of an account, plans of studies included; asks first."""
    user = find_account(code)
    name = user.person.pseudonym
    if not is_sure(request):
        question = Confirmation(
            title=f"Forget who {name} is?",
            facts=(
                "Username, pseudonym, preferences and links go; nobody can sign in.",
                "Votes and labels stay and count on, under a number.",
                "Ratings that are frozen keep the old pseudonym. There is no way back.",
            ),
            button="Forget the identity",
            back=reverse("people"),
            crumbs=(("People", reverse("people")),),
        )
        return ask(request, question)
    with refusals_told(request):
        forget_identity(user=user, actor=user_of(request))
        messages.success(request, f"{name} is forgotten.")
    return redirect("people")


# --- Invitations -------------------------------------------------------------------------------


@allow_only(ADMIN)
@never_cache
@require_POST
def invite_experts(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Make links, for one expert or for all without one, and show them this once."""
    study = get_object_or_404(Study, code=code)
    lines = expert_lines(study, timezone.now())
    wanted = request.POST.get("expert")
    if wanted:
        chosen = [line for line in lines if str(line.tally.expert.person.code) == wanted]
    else:
        chosen = [line for line in lines if line.may_be_invited and not line.has_live_link]
    if not chosen:
        messages.info(request, "Nobody was left to invite; no link was made.")
        return redirect("experts", code=study.code)
    made = []
    with refusals_told(request):
        for line in chosen:
            fresh = links.invite(study=study, expert=line.tally.expert, actor=user_of(request))
            address = request.build_absolute_uri(reverse("invitation", args=[fresh.token]))
            made.append({"invitation": fresh.invitation, "address": address})
        return render(request, "studies/links.html", {"study": study, "links": made})
    return redirect("experts", code=study.code)


@allow_only(ADMIN)
@require_POST
def revoke_invitation(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Revoke one link; whoever came in by it is signed out."""
    invitation = get_object_or_404(Invitation.objects.select_related("study"), code=code)
    links.revoke(invitation=invitation, actor=user_of(request))
    messages.success(request, f"The link of {_named(invitation)} was taken back.")
    return redirect("experts", code=invitation.study.code)


@login_not_required
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def invitation_page(request: HttpRequest, token: str) -> HttpResponse:
    """Who invited whom to what. Only the button signs in: mail scanners open links, too."""
    try:
        invitation = invitation_by_token(token)
    except NotYours as error:
        raise Http404 from error
    context: dict[str, Any] = {"invitation": invitation, "host": _host(invitation)}
    state = invitation.state(timezone.now())
    if state in Invitation.ALIVE and may_be_let_in(invitation.expert):
        if request.method != "POST":
            return keep_secret(render(request, "invitation.html", context))
        try:
            return keep_secret(_let_in(request, token))
        except LinkOver:  # it ended just now
            state = invitation_by_token(token).state(timezone.now())
    context["is_expired"] = state == Invitation.State.EXPIRED
    return keep_secret(render(request, "invitation_over.html", context, status=GONE))


def _let_in(request: HttpRequest, token: str) -> HttpResponse:
    invitation = links.accept(token=token)
    login(request, invitation.expert, backend=BACKEND)
    request.session[links.SESSION_KEY] = str(invitation.code)
    request.session.set_expiry(SESSION_S)
    is_open = invitation.study.state == Study.State.OPEN
    answer = redirect("vote", code=invitation.study.code) if is_open else redirect("home")
    # Shown on the sign-in page alone, when this session is over.
    _set_cookie(request, answer, LINK_COOKIE, token, lives_s=SESSION_S)
    return with_own_language(answer, invitation.expert)


def _set_cookie(
    request: HttpRequest, answer: HttpResponse, name: str, value: str, *, lives_s: int, **at: str
) -> None:
    answer.set_cookie(
        name,
        value,
        max_age=lives_s,
        httponly=True,
        secure=request.is_secure(),
        samesite="Lax",
        **at,
    )


def _host(invitation: Invitation) -> str | None:
    """Return the name of who invited, None where the command did."""
    by = invitation.invited_by
    if by is None:
        return None
    return by.get_full_name() or (by.person.pseudonym if hasattr(by, "person") else by.username)


# --- Enrolment ---------------------------------------------------------------------------------


@login_not_required
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def enrol_page(request: HttpRequest, token: str) -> HttpResponse:
    """What the study is, what one agrees to, and a form for the id; then the first pair."""
    try:
        enrolment = enrolment_by_token(token)
    except NotYours as error:
        raise Http404 from error
    user = request.user
    if user.is_authenticated and enrolment.voters.filter(expert=user).exists():
        return redirect("vote", code=enrolment.study.code)
    if (returning := _returning(request, enrolment)) is not None:
        if "again" in request.POST:
            return _sign_in(request, returning)
        return render(request, "enrol_again.html", {"study": enrolment.study})
    given = next((request.GET[name] for name in ID_PARAMETERS if name in request.GET), "")
    form = NewcomerForm(request.POST or None, initial={"external_id": given[:LONGEST_ID]})
    is_over = not enrolment.is_open or enrolment.study.state != Study.State.OPEN
    if form.is_valid():
        entered = form.cleaned_data
        with refusals_in(form, "external_id"):
            try:
                voter = enrol(
                    token=token,
                    external_id=entered["external_id"],
                    agreed_sha256=entered["agreed_sha256"],
                )
                return _sign_in(request, voter)
            except EnrolmentOver:
                is_over = True
        enrolment.refresh_from_db()
    if is_over:
        return render(request, "enrol_over.html", {"study": enrolment.study}, status=GONE)
    context = {"enrolment": enrolment, "form": form}
    return render(request, "enrol.html", context, status=422 if form.errors else 200)


def _sign_in(request: HttpRequest, voter: EnrolledVoter) -> HttpResponse:
    """Show the first pair, and let this browser come back when its session is over."""
    enrolment = voter.enrolment
    login(request, voter.expert, backend=BACKEND)
    request.session.set_expiry(SESSION_S)
    answer = redirect("vote", code=enrolment.study.code)
    proof = signing.dumps(str(voter.code), salt=VOTER_COOKIE)
    page = reverse("enrol", args=[enrolment.token])
    _set_cookie(request, answer, VOTER_COOKIE, proof, lives_s=RETURN_S, path=page)
    _set_cookie(
        request, answer, ENROLMENT_COOKIE, enrolment.token, lives_s=RETURN_S, path=reverse("login")
    )
    return answer


def _returning(request: HttpRequest, enrolment: Enrolment) -> EnrolledVoter | None:
    """Return who enrolled in this browser, None where the study takes no votes."""
    try:
        proof = request.COOKIES.get(VOTER_COOKIE, "")
        code = signing.loads(proof, salt=VOTER_COOKIE, max_age=RETURN_S)
    except signing.BadSignature:
        return None
    if enrolment.study.state != Study.State.OPEN:
        return None
    return enrolment.voters.filter(code=code, expert__is_active=True).first()


@allow_only(ADMIN)
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def enrolment_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The link with its rules, and who came by it."""
    study = get_object_or_404(Study, code=code)
    enrolment = Enrolment.objects.filter(study=study).first()
    rules = {name: getattr(enrolment, name) for name in EnrolmentForm.base_fields if enrolment}
    form = EnrolmentForm(request.POST or None, initial=rules)
    if form.is_valid():
        with refusals_in(form):
            set_enrolment(study=study, actor=user_of(request), **form.cleaned_data)
            messages.success(request, "Saved. What the link says holds from now on.")
            return redirect("enrolment", code=code)
    context: dict[str, Any] = {"study": study, "enrolment": enrolment, "form": form}
    if enrolment is not None:
        context |= {
            "address": request.build_absolute_uri(reverse("enrol", args=[enrolment.token])),
            "state": state_of(enrolment),
            "page": read_page(request, enrolled_voters(enrolment), size=PAGE),
        }
    status = 422 if form.errors else 200
    return render(request, "studies/enrolment.html", context, status=status)


@allow_only(ADMIN)
@require_POST
def drop_out(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Free the places of all who were silent for too long, now."""
    enrolment = get_object_or_404(Enrolment, study__code=code)
    freed = drop_silent(enrolment=enrolment, actor=user_of(request))
    text = "1 place is free again." if freed == 1 else f"{freed} places are free again."
    messages.info(request, text)
    return redirect("enrolment", code=code)


@allow_only(ADMIN)
@never_cache
@require_safe
def voters_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Who is to be thanked or paid: ids, progress and completion codes, as CSV."""
    enrolment = get_object_or_404(Enrolment, study__code=code)
    return HttpResponse(
        csv_text(COLUMNS, map(_line_of, enrolled_voters(enrolment))),
        content_type="text/csv; charset=utf-8",
        headers={"Content-Disposition": 'attachment; filename="voters.csv"'},
    )


def _line_of(voter: Any) -> tuple[object, ...]:
    times = (voter.enrolled_at, voter.last_vote_at, voter.dropped_at)
    code = code_told(voter)
    return (
        voter.expert.person.pseudonym,
        voter.external_id,
        *(voter.planned, voter.answered, voter.skipped),
        *(None if at is None else at.isoformat() for at in times),
        int(bool(code)),
        code,
    )
