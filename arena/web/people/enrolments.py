"""Taking part in a study by a link that is for everybody, and what an admin sees of it."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth import login
from django.contrib.auth.decorators import login_not_required
from django.contrib.auth.models import User
from django.core import signing
from django.core.paginator import Paginator
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy, ngettext
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.errors import ArenaError, EnrolmentOver, NotYours
from arena.models import EnrolledVoter, Enrolment, Study
from arena.queries.studies.enrolments import (
    code_told,
    enrolled_voters,
    enrolment_by_token,
    state_of,
)
from arena.services.cells import csv_text
from arena.services.enrolments import (
    LONGEST_CONSENT,
    LONGEST_ID,
    drop_silent,
    enrol,
    set_enrolment,
)
from arena.site.access import ADMIN, allow_only
from arena.web.people.invitations import BACKEND, GONE, SESSION_S
from augment.errors import AugmentError

PAGE = 100
VOTER_COOKIE, ENROLMENT_COOKIE = "arena_voter", "arena_enrolment"
RETURN_S = 365 * 24 * 3600
"""So long a browser knows who enrolled in it; its session ends before."""

ID_PARAMETERS = ("id", "worker", "workerId", "PROLIFIC_PID")
"""In an address, what the platforms call the id of whom they send."""

COLUMNS = (
    *("voter", "id", "planned", "answered", "skipped"),
    *("enrolled_at", "last_vote_at", "dropped_at", "is_done", "completion_code"),
)
_CONSENT = gettext_lazy(
    "I take part of my own free will and may stop at any time. My answers, the time that they "
    "took and the id that I enter are kept to evaluate this study; the id is published nowhere."
)


class EnrolmentForm(forms.Form):
    """What an admin says about a link."""

    consent = forms.CharField(max_length=LONGEST_CONSENT, initial=_CONSENT)
    asks_for = forms.CharField(max_length=120, initial=gettext_lazy("Your name or worker ID"))
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
    given = next((request.GET[name] for name in ID_PARAMETERS if name in request.GET), "")
    returning = _returning(request, enrolment)
    if returning is not None and "again" in request.POST:
        return _sign_in(request, returning)
    if returning is not None:
        return render(request, "enrol_again.html", {"study": enrolment.study})
    form = NewcomerForm(request.POST or None, initial={"external_id": given[:LONGEST_ID]})
    if request.method == "POST" and form.is_valid():
        try:
            voter = enrol(
                token=token,
                external_id=form.cleaned_data["external_id"],
                agreed_sha256=form.cleaned_data["agreed_sha256"],
            )
        except EnrolmentOver:
            return _over(request, enrolment)
        except (ArenaError, AugmentError) as error:
            form.add_error("external_id", str(error))
            enrolment.refresh_from_db()
        else:
            return _sign_in(request, voter)
    if not enrolment.is_open or enrolment.study.state != Study.State.OPEN:
        return _over(request, enrolment)
    context = {"enrolment": enrolment, "form": form}
    return render(request, "enrol.html", context, status=422 if form.errors else 200)


@allow_only(ADMIN)
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def enrolment_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The link with its rules, and who came by it."""
    study = get_object_or_404(Study, code=code)
    enrolment = Enrolment.objects.filter(study=study).first()
    form = EnrolmentForm(request.POST or None, initial=_rules_of(enrolment))
    if request.method == "POST" and form.is_valid():
        actor = cast(User, request.user)
        try:
            set_enrolment(study=study, actor=actor, **form.cleaned_data)
        except (ArenaError, AugmentError) as error:
            form.add_error(None, str(error))
        else:
            messages.success(request, _("Saved. What the link says holds from now on."))
            return redirect("enrolment", code=code)
    context: dict[str, Any] = {"study": study, "enrolment": enrolment, "form": form}
    if enrolment is not None:
        pages = Paginator(enrolled_voters(enrolment), PAGE)
        context |= {
            "address": request.build_absolute_uri(reverse("enrol", args=[enrolment.token])),
            "state": state_of(enrolment),
            "page": pages.get_page(request.GET.get("page")),
        }
    status = 422 if form.errors else 200
    return render(request, "studies/enrolment.html", context, status=status)


@allow_only(ADMIN)
@require_POST
def drop_out(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Give on the places of all who were silent for too long, now."""
    enrolment = get_object_or_404(Enrolment, study__code=code)
    freed = drop_silent(enrolment=enrolment, actor=cast(User, request.user))
    told = ngettext("%(n)s place is free again.", "%(n)s places are free again.", freed)
    messages.info(request, told % {"n": freed})
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


# --- Private -----------------------------------------------------------------------------------


def _sign_in(request: HttpRequest, voter: EnrolledVoter) -> HttpResponse:
    """The first pair, and what brings this browser back when its session is over."""
    enrolment = voter.enrolment
    login(request, voter.expert, backend=BACKEND)
    request.session.set_expiry(SESSION_S)
    answer = redirect("vote", code=enrolment.study.code)
    proof = signing.dumps(str(voter.code), salt=VOTER_COOKIE)
    page = reverse("enrol", args=[enrolment.token])
    for name, value, path in (
        (VOTER_COOKIE, proof, page),
        (ENROLMENT_COOKIE, enrolment.token, reverse("login")),
    ):
        answer.set_cookie(
            name,
            value,
            max_age=RETURN_S,
            path=path,
            httponly=True,
            secure=request.is_secure(),
            samesite="Lax",
        )
    return answer


def _returning(request: HttpRequest, enrolment: Enrolment) -> EnrolledVoter | None:
    """Who enrolled in this browser, None where nobody did or the study takes no votes."""
    try:
        code = signing.loads(
            request.COOKIES.get(VOTER_COOKIE, ""), salt=VOTER_COOKIE, max_age=RETURN_S
        )
    except signing.BadSignature:
        return None
    if enrolment.study.state != Study.State.OPEN:
        return None
    return enrolment.voters.filter(code=code, expert__is_active=True).first()


def _over(request: HttpRequest, enrolment: Enrolment) -> HttpResponse:
    return render(request, "enrol_over.html", {"study": enrolment.study}, status=GONE)


def _rules_of(enrolment: Enrolment | None) -> dict[str, Any] | None:
    if enrolment is None:
        return None
    return {name: getattr(enrolment, name) for name in EnrolmentForm.base_fields}


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
