"""Experts of a study: progress, authors, links to invite and to enrol; forgetting somebody."""

import uuid
from typing import Any

from django import forms
from django.contrib import messages
from django.contrib.auth import login
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.translation import gettext_lazy
from django.views.decorators.cache import never_cache

from arena.errors import EnrolmentOver, LinkOver
from arena.exports.cells import csv_text
from arena.exports.formats import attach
from arena.models import Enrolment, Study
from arena.people import links, services
from arena.people.pages import find_account, link_page, show_new_links, with_own_language
from arena.shell import access, acts, listing, receipts
from arena.studies.forms import AuthorForm
from arena.studies.queries import expert_lines, state_of
from arena.studies.services import planning, taking_part
from arena.voting.queries.ballots import list_voters
from augment.errors import Conflict

SESSION_S = 30 * 24 * 3600

PAGE = 100
ID_PARAMETERS = ("id", "worker", "workerId", "PROLIFIC_PID")
"""In an address, what the platforms call the id of whom they send."""

PLATFORM_COLUMNS = {"STUDY_ID": "platform_study", "SESSION_ID": "platform_session"}
PROLIFIC = "?PROLIFIC_PID={{%PROLIFIC_PID%}}&STUDY_ID={{%STUDY_ID%}}&SESSION_ID={{%SESSION_ID%}}"

COLUMNS = (
    *("voter", "id", "planned", "answered", "skipped"),
    *("enrolled_at", "last_vote_at", "dropped_at", "is_done"),
    *("completion_code", "study_id", "session_id"),
)
CONSENT = (
    "I take part of my own free will and may stop at any time. My answers, the time that they "
    "took and the id that I enter are kept to evaluate this study; the id is published nowhere."
)


class EnrolmentForm(forms.Form):
    """The rules of an enrolment link."""

    consent = forms.CharField(
        max_length=taking_part.LONGEST_CONSENT,
        initial=CONSENT,
        label="What people agree to",
        widget=forms.Textarea({"rows": 5}),
    )
    asks_for = forms.CharField(
        max_length=120,
        initial=gettext_lazy("Your name or worker ID"),
        label="What they enter",
        help_text="One ID has one place. Admins alone see it.",
    )
    places = forms.IntegerField(min_value=1, max_value=100_000, initial=100)
    votes_each = forms.IntegerField(
        min_value=1,
        max_value=10_000,
        initial=30,
        label="Pairs for each",
        help_text="Hidden repeats and checks come on top, as the study’s rules say.",
    )
    drop_out_after_h = forms.IntegerField(
        min_value=1,
        max_value=10_000,
        required=False,
        initial=24,
        label="Hours of silence until a place is free again",
        help_text="Empty: never. Answers that were given stay; the rest goes to who comes next.",
    )
    completes_with = forms.RegexField(
        r"\A(https://[^\s/@]+(/\S*)?|[\w -]+)\Z",
        max_length=200,
        required=False,
        strip=True,
        label="Completion code or return address",
        help_text="The study’s own on a platform, such as "
        "https://app.prolific.com/submissions/complete?cc=… Empty: everybody gets a code of "
        "their own.",
        error_messages={"invalid": "A code, or an address that begins with https://."},
    )
    is_open = forms.BooleanField(required=False, initial=True, label="The link takes people on")


class NewcomerForm(forms.Form):
    """Details that a newcomer enters."""

    external_id = forms.CharField(
        max_length=taking_part.LONGEST_ID,
        error_messages={"required": gettext_lazy("Please enter it.")},
    )
    agreed = forms.BooleanField(
        error_messages={"required": gettext_lazy("You take part only if you agree.")}
    )
    agreed_sha256 = forms.CharField(max_length=64)


# --- The experts of a study --------------------------------------------------------------------


@access.act_for(access.ADMIN, back="study")
def mark(request: HttpRequest, code: uuid.UUID) -> None:
    """Mark an expert as author of a contestant, or take it back, be the study open or closed."""
    study = get_object_or_404(Study, code=code)
    form = AuthorForm(request.POST, study=study)
    if not form.is_valid():
        acts.tell_errors(request, form)
        return
    contestant = form.cleaned_data["contestant"]
    expert = study.experts.select_related("person").get(username=form.cleaned_data["expert"])
    is_author = "back" not in request.POST
    links.mark_author(
        study=study,
        expert=expert,
        contestant=contestant,
        is_author=is_author,
        actor=access.get_user(request),
    )
    state = "is" if is_author else "is not"
    messages.success(
        request, f"{expert.person.pseudonym} {state} marked as author of {contestant}."
    )


@access.form_for(access.ADMIN)
def forget_person(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Remove the identity of an account, plans of studies included; asks first."""
    user = find_account(code)
    name = user.person.pseudonym
    if not acts.is_sure(request):
        question = acts.Confirmation(
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
        return acts.ask(request, question)
    with acts.refusals_told(request):
        taking_part.forget_identity(user=user, actor=access.get_user(request))
        messages.success(request, f"{name} is forgotten.")
    return redirect("people")


# --- Invitations -------------------------------------------------------------------------------


@never_cache
@access.act_for(access.ADMIN, back="study")
def invite_experts(request: HttpRequest, code: uuid.UUID) -> HttpResponse | None:
    """Make links, for one expert or for all without one, and show them this once."""
    study = get_object_or_404(Study, code=code)
    wanted = request.POST.get("expert")
    chosen = [
        line.tally.expert
        for line in expert_lines(study)
        if str(line.tally.expert.person.code) == wanted or (not wanted and line.waits_for_link)
    ]
    if not chosen:
        messages.info(request, "Nobody was left to invite; no link was made.")
        return None
    return show_new_links(request, chosen, study)


@access.act_for(access.ADMIN, back="study")
def revoke_invitation(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Revoke one link; whoever came in by it is signed out."""
    study = get_object_or_404(Study, invitations__code=code)
    links.revoke(invitation=study.invitations.get(code=code), actor=access.get_user(request))
    messages.success(request, "The link was taken back.")
    return redirect("study", code=study.code)


@link_page
def invitation_page(request: HttpRequest, token: str) -> HttpResponse:
    """Show who invites whom to what. Only the button signs in: mail scanners open links, too."""
    invitation = links.find_invitation(token)
    if invitation is None:
        raise Http404
    if request.method == "POST":
        invitation = links.accept(token=token)
        answer = _sign_in(request, invitation.expert, invitation.study)
        request.session[links.SESSION_KEY] = str(invitation.code)
        return answer
    if not links.lets_in(invitation):
        raise LinkOver
    return render(request, "invitation.html", {"invitation": invitation})


def _sign_in(request: HttpRequest, expert: User, study: Study | None) -> HttpResponse:
    """Sign an expert in here and out on every other device, and lead to the study."""
    if expert.last_login is not None:
        services.end_sessions(services.SIGNED_IN, {str(expert.pk)})
    login(request, expert, backend=access.BACKEND)
    request.session.set_expiry(SESSION_S)
    answer = redirect("home") if study is None else redirect("vote", code=study.code)
    return with_own_language(answer, expert)


# --- Enrolment ---------------------------------------------------------------------------------


@link_page
def enrol_page(request: HttpRequest, token: str) -> HttpResponse:
    """Show the study and its consent text with a form for the id; continue to the first pair.

    Whoever comes again from a platform goes on at this device if they say so.
    """
    enrolment = get_object_or_404(Enrolment.objects.select_related("study"), token=token)
    user, study = request.user, enrolment.study
    if user.is_authenticated and enrolment.voters.filter(expert=user).exists():
        return redirect("vote", code=study.code)
    try:
        ids = _read_ids(request)
    except Conflict as error:
        return render(request, "enrol_over.html", {"problem": error}, status=422)
    voter = taking_part.find_returning(enrolment, ids["external_id"], ids["platform_session"])
    if voter is None:
        return _take_on(request, enrolment, ids)
    if "go_on" in request.POST:
        return _sign_in(request, voter.expert, study)
    pairs = study.matchups.filter(expert=voter.expert).count()
    return render(request, "enrol.html", {"enrolment": enrolment, "voter": voter, "pairs": pairs})


def _read_ids(request: HttpRequest) -> dict[str, str]:
    ids = {"external_id": next(filter(None, map(request.GET.get, ID_PARAMETERS)), "")}
    ids |= {column: request.GET.get(name, "") for name, column in PLATFORM_COLUMNS.items()}
    return {column: text and taking_part.check_id(text) for column, text in ids.items()}


def _take_on(request: HttpRequest, enrolment: Enrolment, ids: dict[str, str]) -> HttpResponse:
    form = NewcomerForm(request.POST or None, initial=ids)
    is_over = not enrolment.is_open or enrolment.study.state != Study.State.OPEN
    if form.is_valid():
        ids |= {name: form.cleaned_data[name] for name in ("external_id", "agreed_sha256")}
        with acts.refusals_in(form, "external_id"):
            try:
                return _sign_in(request, _enrol_once(request, enrolment, ids), enrolment.study)
            except EnrolmentOver:
                is_over = True
        enrolment.refresh_from_db()
    if is_over:
        return render(request, "enrol_over.html", {"study": enrolment.study}, status=access.GONE)
    pairs = planning.Planning.begin(enrolment.study).count_pairs(enrolment.votes_each)
    context = {"enrolment": enrolment, "form": form, "pairs": pairs}
    return render(request, "enrol.html", context, status=422 if form.errors else 200)


def _enrol_once(request: HttpRequest, enrolment: Enrolment, ids: dict[str, str]) -> User:
    """Take somebody on; the same form again is the same newcomer, whose first answer was lost."""
    made = receipts.digest_body(ids)
    enrolled = receipts.answer_once(
        f"enrol {enrolment.token} {request.POST.get(access.CSRF_FIELD) or uuid.uuid4()} {made}",
        made,
        lambda: taking_part.enrol(token=enrolment.token, **ids),
        lambda voter: (access.CREATED, str(voter.expert_id).encode()),
    )
    if not isinstance(enrolled, receipts.StoredAnswer):
        return enrolled.expert
    return get_object_or_404(User, pk=int(enrolled.content), is_active=True)


@access.form_for(access.ADMIN)
@never_cache
def enrolment_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The link with its rules, and who came by it."""
    study = get_object_or_404(Study, code=code)
    enrolment = Enrolment.objects.filter(study=study).first()
    rules = {name: getattr(enrolment, name) for name in EnrolmentForm.base_fields if enrolment}
    form = EnrolmentForm(request.POST or None, initial=rules)
    if form.is_valid():
        with acts.refusals_in(form):
            taking_part.set_enrolment(
                study=study, rules=form.cleaned_data, actor=access.get_user(request)
            )
            messages.success(request, "Saved. What the link says holds from now on.")
            return redirect("enrolment", code=code)
    context: dict[str, Any] = {"study": study, "enrolment": enrolment, "form": form}
    if enrolment is not None:
        address = request.build_absolute_uri(reverse("enrol", args=[enrolment.token]))
        context |= {
            "address": address,
            "prolific": address + PROLIFIC,
            "state": state_of(enrolment),
            "page": listing.read_page(request, list_voters(study), size=PAGE),
        }
    status = 422 if form.errors else 200
    return render(request, "studies/enrolment.html", context, status=status)


@access.page_for(access.ADMIN)
@never_cache
def voters_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Return ids, progress and completion codes of voters as CSV, for thanks or payment."""
    study = get_object_or_404(Study, code=code, enrolment__isnull=False)
    content = csv_text(COLUMNS, map(_voter_row, list_voters(study)))
    return attach(content, "text/csv; charset=utf-8", "voters.csv")


def _voter_row(voter: Any) -> tuple[object, ...]:
    times = (voter.enrolled_at, voter.last_vote_at, voter.dropped_at)
    return (
        voter.expert.person.pseudonym,
        voter.external_id,
        *(voter.planned, voter.answered, voter.skipped),
        *(None if at is None else at.isoformat() for at in times),
        int(voter.is_done),
        (voter.enrolment.completes_with or voter.completion_code) if voter.is_done else "",
        *(voter.platform_study, voter.platform_session),
    )
