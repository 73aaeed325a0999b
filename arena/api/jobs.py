"""How far a job is, for a page that asks every two seconds."""

from __future__ import annotations

import hashlib
import json
import uuid

from django.shortcuts import get_object_or_404
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import StaffOnly
from arena.api.errors import ApiView
from augment.models import GenerationJob
from augment.services.running.summary import count_rows
from augment.services.running.workers import workforce


class JobProgressView(ApiView):
    """GET answers 304 while nothing has changed since the ETag that came with the request."""

    permission_classes = (StaffOnly,)

    def get(self, request: Request, code: uuid.UUID) -> Response:
        """State, counts by state, whether it is under way and whether anybody works on it."""
        found = count_rows(get_object_or_404(GenerationJob, code=code))
        body = {
            "state": found.job.state,
            "total": found.total,
            "settled": found.settled,
            "by_state": {state.value: number for state, number in found.by_state.items()},
            "calls": found.job.spent_calls,
            "is_over": not found.is_moving,
            "is_worked_on": found.is_moving and workforce().works,
        }
        digest = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()[:32]
        headers = {"ETag": f'"{digest}"', "Cache-Control": "private, no-cache"}
        if headers["ETag"] in request.headers.get("If-None-Match", ""):
            return Response(status=304, headers=headers)
        return Response(body, headers=headers)
