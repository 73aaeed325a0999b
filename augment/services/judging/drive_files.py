"""A drive as a file: what the page plays, moving pictures, a strip of stills."""

from __future__ import annotations

import json
from typing import Any

from augment.models import Simulation
from augment.render.film import animation, strip
from augment.services.judging.simulations import trace_document
from augment.simulation.trace import blind_trace

FILES = {"json": "application/json", "gif": "image/gif", "apng": "image/apng", "png": "image/png"}
"""Content types by the name of the form; png is the strip."""


def drive_file(row: Simulation, form: str, *, before: Simulation | None = None) -> bytes:
    """A driven row as a file.

    Args:
        row: With its trace.
        form: One of `FILES`.
        before: The same scene before the change, to be drawn above it.
    """
    traces = [trace_document(one) for one in (before, row) if one is not None]
    if form == "json":
        return json.dumps(traces[-1], separators=(",", ":")).encode()
    if form == "png":
        return strip(traces)
    return animation(traces, file_format=form)


def blind_drive(row: Simulation) -> dict[str, Any]:
    """A driven row as experts see it who must not learn who changed the scene."""
    return blind_trace(trace_document(row))
