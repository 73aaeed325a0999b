"""The pictures of a rating: what experts disagree on, the worst of a contestant, all of them."""

from __future__ import annotations

import uuid
from typing import Any
from urllib.parse import urlencode

from django import forms
from django.core.paginator import Paginator
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import render
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.errors import NoSnapshot
from arena.exports.contact_sheet import ContactSheet, contact_sheet, sheet_pdf
from arena.exports.tables import LeaderboardTable, leaderboard_table
from arena.models import Snapshot
from arena.queries.galleries import by_faults, disputed_pairs, pictures_of, with_pictures
from arena.queries.judged import is_imported
from arena.queries.results import snapshot_to_export
from arena.web.access import STAFF, allow_only
from arena.web.results import asked_rating, get_readable_study
from augment.services.scenarios.types import type_choices

PAIRS_A_PAGE, PICTURES_A_PAGE, SCENARIOS_A_PAGE = 10, 24, 6
LOST, FAULTS = "lost", "faults"


class GalleryForm(forms.Form):
    """Which pictures, as they stand in the address."""

    contestant = forms.ChoiceField(label="Contestant", required=False)
    order = forms.ChoiceField(
        label="Begin with",
        required=False,
        choices=[
            (LOST, "most often beaten"),
            (FAULTS, "most faults labelled"),
        ],
    )
    type = forms.ChoiceField(label="Scenario type", required=False)

    def __init__(self, request: HttpRequest, table: LeaderboardTable, *fields: str) -> None:
        """Offer what the rating has; the lowest one is the contestant unless told otherwise."""
        rows = [row for row in table.rows if row.votes]
        first = {"contestant": rows[-1].slug if rows else "", "order": LOST}
        data = {name: request.GET.get(name) or first.get(name, "") for name in fields}
        super().__init__(data)
        for name in set(self.fields) - set(fields):
            del self.fields[name]
        offered = {
            "contestant": [(row.slug, row.model) for row in table.rows],
            "type": [("", "all"), *type_choices()],
        }
        for name, choices in offered.items():
            if (field := self.fields.get(name)) is not None:
                assert isinstance(field, forms.ChoiceField)
                field.choices = choices

    def value_of(self, name: str) -> str:
        """What was chosen.

        Raises:
            Http404: It is none of what is offered.
        """
        if not self.is_valid():
            raise Http404(self.errors.as_text())
        return str(self.cleaned_data[name])


@allow_only(*STAFF)
@require_safe
def disagreement_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Pairs of pictures that several experts judged, the most disputed first."""
    snapshot, table = _rating(request, code)
    form = GalleryForm(request, table, "type")
    units = disputed_pairs(snapshot, type_name=form.value_of("type"))
    page = Paginator(units, PAIRS_A_PAGE).get_page(request.GET.get("page"))
    context = {"page": page, "pairs": with_pictures(list(page.object_list))}
    return _shown(request, snapshot, "disagreement", form, context)


@allow_only(*STAFF)
@require_safe
def worst_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The pictures of a contestant, those first that lost most or have most faults."""
    snapshot, table = _rating(request, code)
    form = GalleryForm(request, table, "contestant", "order", "type")
    slug, kind = form.value_of("contestant"), form.value_of("type")
    found = pictures_of(snapshot, slug, type_name=kind) if slug else []
    if form.value_of("order") == FAULTS:
        found = by_faults(found)
    page = Paginator(found, PICTURES_A_PAGE).get_page(request.GET.get("page"))
    context = {"page": page, "slug": slug, "by_faults": form.value_of("order") == FAULTS}
    return _shown(request, snapshot, "worst", form, context)


@allow_only(*STAFF)
@require_safe
def sheet_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """All contestants side by side, scenario by scenario."""
    snapshot, table = _rating(request, code)
    form = GalleryForm(request, table, "type")
    sheet, page = _sheet(request, snapshot, table, form)
    kept = {"rating": str(snapshot.code), "type": form.value_of("type"), "page": page.number}
    context = {"page": page, "sheet": sheet, "file_query": urlencode(kept)}
    return _shown(request, snapshot, "sheet", form, context)


@allow_only(*STAFF)
@require_safe
def sheet_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The same page of the contact sheet as a PDF; the command writes all of it."""
    snapshot, table = _rating(request, code)
    sheet, page = _sheet(request, snapshot, table, GalleryForm(request, table, "type"))
    name = f"{slugify(snapshot.study.name) or 'study'}-contact-sheet-{page.number}.pdf"
    return HttpResponse(
        sheet_pdf(sheet),
        content_type="application/pdf",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


# --- Private -----------------------------------------------------------------------------------


def _rating(request: HttpRequest, code: uuid.UUID) -> tuple[Snapshot, LeaderboardTable]:
    study = get_readable_study(request, code)
    try:
        snapshot = snapshot_to_export(study, asked_rating(request))
    except NoSnapshot as error:
        raise Http404 from error
    if is_imported(study):
        raise Http404("Votes from a file have no pictures.")
    return snapshot, leaderboard_table(snapshot)


def _sheet(
    request: HttpRequest, snapshot: Snapshot, table: LeaderboardTable, form: GalleryForm
) -> tuple[ContactSheet, Any]:
    rows = snapshot.study.scenarios.order_by("type", "slug")
    if kind := form.value_of("type"):
        rows = rows.filter(type=kind)
    page = Paginator(rows.defer("reference"), SCENARIOS_A_PAGE).get_page(request.GET.get("page"))
    return contact_sheet(snapshot, table, list(page.object_list)), page


def _shown(
    request: HttpRequest, snapshot: Snapshot, name: str, form: GalleryForm, more: dict[str, Any]
) -> HttpResponse:
    context = {
        "study": snapshot.study,
        "snapshot": snapshot,
        "form": form,
        "gallery": name,
        "is_staff": True,
        **more,
    }
    return render(request, f"results/{name}.html", context)
