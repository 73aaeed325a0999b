"""Two rated studies side by side: the contestants of both, by name."""

import uuid
from typing import Any

from django import forms
from django.http import HttpRequest, HttpResponse
from django.shortcuts import render

from arena.models import Snapshot, Study
from arena.results.pages.plots import plot
from arena.results.pages.ratings import get_readable_study, get_snapshot
from arena.results.pages.tabs import describe
from arena.shell.access import STAFF, page_for


class OtherStudyForm(forms.Form):
    """Choice of the rated study beside this one."""

    other = forms.ModelChoiceField(
        Study.objects.none(), label="Compare with", to_field_name="code", empty_label=None
    )

    def __init__(self, data: Any, *, study: Study) -> None:
        super().__init__(data)
        rated = Snapshot.objects.filter(state=Snapshot.State.READY).values("study")
        others = Study.objects.filter(state=Study.State.CLOSED, pk__in=rated).exclude(pk=study.pk)
        field: Any = self.fields["other"]
        field.queryset = others.select_related("vote_file").order_by("name")
        field.widget.attrs["class"] = "input"


@page_for(*STAFF)
def comparison_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """A choice of another study, and once it is made both tables line by line."""
    study = get_readable_study(request, code)
    form = OtherStudyForm(request.GET or None, study=study)
    context: dict[str, Any] = {"study": study, "form": form}
    if form.is_valid():
        rated = [get_snapshot(request, code) for code in (study, form.cleaned_data["other"])]
        sides = [_side(snapshot) for snapshot in rated]
        slugs = dict.fromkeys(slug for side in sides for slug in side["by_slug"])
        context["sides"] = sides
        context["lines"] = [
            [(side["ticks"], side["by_slug"].get(slug)) for side in sides] for slug in slugs
        ]
    status = 422 if form.errors else 200
    return render(request, "results/comparison.html", context, status=status)


def _side(snapshot: Snapshot) -> dict[str, Any]:
    """A study's sentence, its axis, and its lines by contestant."""
    description = describe(snapshot, is_staff=True)
    drawn = plot(description["table"].rows)
    by_slug = {line["row"].slug: line for line in drawn["lines"] if line["row"].votes}
    return description | {"study": snapshot.study, "ticks": drawn["ticks"], "by_slug": by_slug}
