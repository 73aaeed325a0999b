"""Judges of a study: language models that compare its pairs, beside the experts."""

import uuid
from collections.abc import Mapping, Sequence
from typing import Any

from django import forms
from django.contrib import messages
from django.db import transaction
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render
from django.urls import reverse
from django.utils.text import slugify

from arena.exports.formats import attach
from arena.models import Study
from arena.rating.agreement import AgreementLine, agreement_sentence, share_text
from arena.results.exports.votes import judge_answers_csv
from arena.results.pages.ratings import get_readable_study
from arena.results.queries.judges import WITHOUT_FAMILY, JudgeLine, judge_lines
from arena.results.services.agreement import estimate_study_judge, judge_agreement, start_judge
from arena.shell import acts
from arena.shell.access import ADMIN, STAFF, act_for, get_user, page_for
from arena.shell.forms import RequestForm, offer
from arena.voting.queries.blinding import is_imported
from augment.models import EndpointModel, JudgeRun
from augment.services import read_request, to_inputs
from augment.services.running import JudgeRequest, cancel_judge

MOVING = JudgeRun.State.RUNNING


CAPS = {"cap_usd": "USD at most", "cap_calls": "Calls at most"}


class JudgeForm(RequestForm):
    """Model, question and caps of a judge run."""

    inputs = tuple(field for field in to_inputs(JudgeRequest) if field.name in CAPS)
    judge = forms.ChoiceField(label="Model")
    question = forms.ChoiceField(label="Question", required=False)

    def __init__(self, study: Study, data: Any = None) -> None:
        super().__init__(data)
        rows = EndpointModel.objects.select_related("endpoint").order_by("endpoint", "model")
        offer(self, "judge", [(str(row.code), str(row)) for row in rows])
        self.asked = study.questions
        for name, label in CAPS.items():
            self.fields[name].label, self.fields[name].help_text = label, ""
        offer(self, "question", [(name, name.capitalize()) for name in study.questions])

    def read(self) -> JudgeRequest:
        """Return the request of a form that is valid."""
        row = EndpointModel.objects.select_related("endpoint").get(code=self.cleaned_data["judge"])
        values = {"endpoint": row.endpoint.label, "model": row.model, **self.cleaned_data}
        values["question"] = self.cleaned_data["question"] or self.asked[0]
        return read_request(JudgeRequest, values)


@page_for(*STAFF)
def judges_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show each judge with its agreement, and the form of a new one."""
    study = get_readable_study(request, code)
    lines = judge_lines(study)
    is_moving = any(line.run.state == MOVING for line in lines)
    # A page that reloads itself measures nothing.
    questions = [] if is_moving else study.questions
    agreement = {name: judge_agreement(study, name) for name in questions}
    context = {
        "study": study,
        "lines": _with_agreement(lines, agreement),
        "answers": [
            agreement_sentence(list(lines.values())) for lines in agreement.values() if lines
        ],
        "form": JudgeForm(study),
        "imported": is_imported(study),
        **acts.wait_for_workers(waits=is_moving),
    }
    return render(request, "results/judges.html", context)


@act_for(ADMIN, back="results-judges")
def judge_start(request: HttpRequest, code: uuid.UUID) -> HttpResponse | None:
    """Start a judge, after a question that says what it will use."""
    study = get_readable_study(request, code)
    form = JudgeForm(study, request.POST)
    if not form.is_valid():
        acts.tell_errors(request, form)
        return None
    wanted = form.read()
    expected = estimate_study_judge(study, wanted)
    if acts.wants_to_change(request):
        return None
    if not acts.is_sure(request):
        money = "unknown: nobody entered the model’s price"
        if expected.most_usd is not None:
            money = f"at most {expected.most_usd:.2f} USD"
            if expected.usd is not None:
                money = f"about {expected.usd:.4f} USD by its earlier answers, {money}"
        back = reverse("results-judges", args=[study.code])
        question = acts.Confirmation(
            title=f"Ask {wanted.model} about {expected.pairs} pairs?",
            facts=(
                f"Calls: {expected.calls}, each pair in both orders. Calls that break and are "
                "sent again come on top.",
                f"Cost: {money}. What it was asked before, in just these words, costs nothing.",
                "It sees the instruction and the two pictures, and no name. What it says is no "
                "vote.",
            ),
            button="Start the judge",
            back=back,
            is_final=False,
            crumbs=(("Judges", back),),
        )
        return acts.ask(request, question)
    with transaction.atomic():
        run = start_judge(study, wanted, get_user(request))
        acts.send_later(request, run)
    messages.success(request, f"{run} is asked about {expected.pairs} pairs.")
    return None


@act_for(ADMIN, back="results-judges")
def judge_cancel(request: HttpRequest, code: uuid.UUID, judge: uuid.UUID) -> None:
    """Ask nothing more; what was answered stays."""
    cancel_judge(_judge(request, code, judge), get_user(request))


@page_for(*STAFF)
def judge_answers(request: HttpRequest, code: uuid.UUID, judge: uuid.UUID) -> HttpResponse:
    """Single answers of a judge as CSV."""
    run = _judge(request, code, judge)
    name = f"judge-{slugify(run.model) or 'model'}-answers.csv"
    return attach(judge_answers_csv(run), "text/csv; charset=utf-8", name)


# --- Private -----------------------------------------------------------------------------------


def _judge(request: HttpRequest, code: uuid.UUID, judge: uuid.UUID) -> JudgeRun:
    return get_object_or_404(get_readable_study(request, code).judges, code=judge)


def _with_agreement(
    lines: Sequence[JudgeLine], agreement: Mapping[str, Mapping[str, AgreementLine]]
) -> list[tuple[JudgeLine, str, str]]:
    """Return each judge with its agreement, with and without its own family.

    Of several runs alike it is that of the newest with answers; empty where nothing is known.
    """
    rows, shown = [], set()
    for line in lines:
        shares_by_name, key = agreement.get(line.run.question, {}), (line.run.question, line.name)
        names = line.name, line.name + WITHOUT_FAMILY
        is_measured = bool(line.done) and key not in shown
        shares = [
            share_text(shares_by_name[n].share) if is_measured and n in shares_by_name else ""
            for n in names
        ]
        shown |= {key} if is_measured else set()
        rows.append((line, shares[0], shares[1]))
    return rows
