"""What experts reported: each with its pair as it was shown, without who made what."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from typing import cast

from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render
from django.views.decorators.http import require_safe

from arena.models import Report, Study
from arena.queries.studies.coverage import reports_of
from arena.queries.voting.showings import view_shown
from arena.site.access import ADMIN, allow_only
from augment.models import Augmentation

_LEFT, _RIGHT = Report.Side.LEFT, Report.Side.RIGHT


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedPicture:
    """One side of the reported pair.

    Attributes:
        token: The address of its picture.
        made: The augmentation behind it; None for an admin who votes in the open study.
        mark: Pixels from the left and from the top of the picture, None where none lies in it.
    """

    letter: str
    token: str
    made: Augmentation | None
    is_named: bool
    mark: tuple[float, float] | None


@allow_only(ADMIN)
@require_safe
def report_page(request: HttpRequest, code: uuid.UUID, key: uuid.UUID) -> HttpResponse:
    """One report, with both pictures as the expert saw them and the mark in them."""
    study = get_object_or_404(Study, code=code)
    report = get_object_or_404(reports_of(study), key=key)
    view = view_shown(report.matchup)
    is_blind = (
        study.state == Study.State.OPEN
        and study.experts.filter(pk=cast(User, request.user).pk).exists()
    )
    context = {
        "study": study,
        "report": report,
        "view": view,
        "radius": view["width"] / 40,
        "pictures": _pictures(report, view["width"], view["height"], is_blind=is_blind),
        "before": report.matchup.original_token if report.matchup.original_image else "",
    }
    return render(request, "studies/report.html", context)


def _pictures(
    report: Report, width: float, height: float, *, is_blind: bool
) -> list[ReportedPicture]:
    matchup = report.matchup
    mark = None
    if report.mark_x is not None and report.mark_y is not None:
        mark = (report.mark_x * width, report.mark_y * height)
    sides = (
        (_LEFT, "A", matchup.left_token, matchup.left),
        (_RIGHT, "B", matchup.right_token, matchup.right),
    )
    found = []
    for side, letter, token, made in sides:
        is_named = report.side in (side, Report.Side.BOTH)
        found.append(
            ReportedPicture(
                letter=letter,
                token=token,
                made=None if is_blind else made,
                is_named=is_named,
                mark=mark if is_named else None,
            )
        )
    return found
