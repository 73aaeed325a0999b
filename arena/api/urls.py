"""Addresses of the wire, version 1."""

from __future__ import annotations

from django.urls import URLPattern, path

from arena.api.contestants import ContestantsView
from arena.api.jobs import JobProgressView
from arena.api.matchups import MatchupsView
from arena.api.preferences import PreferencesView
from arena.api.reports import ReportsView
from arena.api.votes import VotesView

urlpatterns: list[URLPattern] = [
    path("contestants", ContestantsView.as_view(), name="api-contestants"),
    path("jobs/<uuid:code>/progress", JobProgressView.as_view(), name="job-progress"),
    path("matchups", MatchupsView.as_view(), name="api-matchups"),
    path("preferences", PreferencesView.as_view(), name="api-preferences"),
    path("reports", ReportsView.as_view(), name="api-reports"),
    path("votes", VotesView.as_view(), name="api-votes"),
]
