"""Addresses of the wire, version 1."""

from __future__ import annotations

from django.urls import URLPattern, path

from arena.api.jobs import JobProgressView
from arena.api.matchups import MatchupsView
from arena.api.votes import VotesView

urlpatterns: list[URLPattern] = [
    path("jobs/<uuid:code>/progress", JobProgressView.as_view(), name="job-progress"),
    path("matchups", MatchupsView.as_view(), name="api-matchups"),
    path("votes", VotesView.as_view(), name="api-votes"),
]
