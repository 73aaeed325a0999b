"""Who contestants are and how they ask."""

from __future__ import annotations

from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import StaffOnly
from arena.api.errors import ApiView
from augment.models import Contestant
from augment.services.running.transcript_export import contestant_document


class ContestantsView(ApiView):
    """GET lists every contestant by slug, in full; attention checks are none."""

    permission_classes = (StaffOnly,)

    def get(self, request: Request) -> Response:
        """As in transcripts, and whether it is retired."""
        rows = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).select_related("endpoint")
        body = [
            contestant_document(row)
            | {"code": str(row.code), "retired_at": row.retired_at and row.retired_at.isoformat()}
            for row in rows.order_by("slug")
        ]
        return Response(body, headers={"Cache-Control": "private, no-cache"})
