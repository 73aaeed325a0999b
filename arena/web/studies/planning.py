"""Planning a study before there is one: how many votes, how long, and what they will tell."""

from __future__ import annotations

import uuid
from dataclasses import asdict, dataclass
from typing import Any, cast
from urllib.parse import urlencode

from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render
from django.urls import reverse
from django.views.decorators.http import require_safe

from arena.models import Study
from arena.rating.planning import Outlook, Prospect, Question, Wish, foretell
from arena.services.prospects import Known, known_of, usual_seconds
from arena.services.study_estimate import ESTIMATE_INPUTS, StudyEstimate
from arena.site.access import STAFF, allow_only
from arena.web.studies.planning_form import EXPECTED, ON_TOP, WANTED, WHO, PlanningForm
from augment.errors import AugmentError


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalLine:
    """A goal, what it takes, and where a study like that is made.

    Attributes:
        prospect: None where no number of votes reaches it; `obstacle` then says why.
    """

    goal: str
    prospect: Prospect | None
    obstacle: str = ""
    address: str = ""


@allow_only(*STAFF)
@require_safe
def planning_page(request: HttpRequest) -> HttpResponse:
    """The form, its answer beside it; with a study at hand, filled in with what that one says."""
    studies = Study.objects.all()
    study = _study_at_hand(request)
    known, fault = Known(values={}), ""
    if study is not None:
        try:
            known = known_of(study, cast(User, request.user))
        except AugmentError as error:
            fault = str(error)
    else:
        seconds = usual_seconds()
        known = Known(values={} if seconds is None else {"seconds": seconds})
    entered = {one.name: value for one in ESTIMATE_INPUTS if (value := request.GET.get(one.name))}
    form = PlanningForm(asdict(StudyEstimate()) | known.values | entered)
    context: dict[str, Any] = {
        "form": form,
        "study": study,
        "studies": studies,
        "known": known,
        "fault": fault,
        "parts": (
            ("Who and what", form.rows_of(WHO)),
            ("What is expected", form.rows_of(EXPECTED)),
            ("What it is to tell", form.rows_of(WANTED)),
            ("On top", form.rows_of(ON_TOP)),
        ),
    }
    if form.is_valid():
        question = StudyEstimate(**form.cleaned_data).question()
        context["lines"] = _lines(question, foretell(question), form.cleaned_data, study)
        context["power"] = f"{form.cleaned_data['power']:g}"
    return render(request, "studies/plan.html", context, status=422 if form.errors else 200)


# --- Private -----------------------------------------------------------------------------------


def _study_at_hand(request: HttpRequest) -> Study | None:
    code = request.GET.get("study")
    if not code:
        return None
    try:
        wanted = uuid.UUID(code)
    except ValueError:
        raise Http404 from None
    return get_object_or_404(Study.objects.select_related("vote_file"), code=wanted)


def _lines(
    question: Question, found: Outlook, entered: dict[str, Any], study: Study | None
) -> list[GoalLine]:
    wishes = (
        (f"Expected widest interval ±{question.half_width:g}",
         found.narrow, "widest"),
        (f"Two that differ by {question.gap:g} told apart",
         found.apart, "gap"),
    )  # fmt: skip
    lines = [
        GoalLine(
            goal=goal,
            prospect=wish.prospect,
            obstacle="" if wish.prospect else _obstacle(question, wish, what),
            address=_new_study(wish.prospect, entered, study),
        )
        for goal, wish, what in wishes
    ]
    if found.in_mind is not None:
        lines.append(
            GoalLine(
                goal="Votes in mind",
                prospect=found.in_mind,
                address=_new_study(found.in_mind, entered, study),
            )
        )
    return lines


def _obstacle(question: Question, wish: Wish, what: str) -> str:
    """Why no number of votes reaches it, and what would."""
    reached = f"{getattr(wish.most, what):.0f}"
    text = (
        "No number of votes reaches it: with every pair judged by everybody it is ±%(points)s."
        if what == "widest"
        else (
            "No number of votes reaches it: with every pair judged by everybody %(points)s points "
            "can be told apart."
        )
    )
    said = [text % {"points": reached}]
    design = question.design
    if wish.experts is not None:
        said.append(f"On {design.scenarios} scenarios it takes {wish.experts} experts or more.")
    if wish.scenarios is not None:
        said.append(f"With {design.experts} experts it takes {wish.scenarios} scenarios or more.")
    if wish.experts is None and wish.scenarios is None:
        said.append("It takes more experts and more scenarios.")
    return " ".join(said)


def _new_study(prospect: Prospect | None, entered: dict[str, Any], study: Study | None) -> str:
    if prospect is None or prospect.votes_per_expert > 10_000:
        return ""
    values: dict[str, Any] = {"votes_per_expert": prospect.votes_per_expert}
    values |= {name: f"{entered[name]:g}" for name in ON_TOP}
    if study is not None:
        values["study"] = study.code
    return f"{reverse('study-new')}?{urlencode(values)}"
