"""Addresses of the API, version 1."""

from __future__ import annotations

from django.urls import URLPattern, path

from arena.api import exports, reference
from arena.api.views import ApiView
from arena.contestants import api
from arena.jobs import api
from arena.people import api
from arena.results import api
from arena.scenarios import api
from arena.studies import api
from arena.voting import api


def _at(address: str, view: type[ApiView], name: str) -> URLPattern:
    found: URLPattern = path(address, view.as_view(), name=name)
    return found


urlpatterns: list[URLPattern] = [
    path("reference/", reference.reference_page, name="api-reference"),
    _at("openapi.json", reference.DocumentView, "api-document"),
    _at("people", api.PeopleView, "api-people"),
    _at("first", api.FirstView, "api-first"),
    _at("welcome", api.WelcomeView, "api-welcome"),
    _at("uploads", api.UploadsView, "api-uploads"),
    _at("uploads/<uuid:code>", api.UploadView, "api-upload"),
    _at("uploads/<uuid:code>/moments", api.MomentsView, "api-moments"),
    _at("moments/<uuid:code>", api.MomentView, "api-moment"),
    _at("moments/<uuid:code>/keep", api.KeepMomentView, "api-moment-keep"),
    _at("scenarios", api.ScenariosView, "api-scenarios"),
    _at("endpoints", api.EndpointsView, "api-endpoints"),
    _at("endpoints/<uuid:code>/models", api.ModelsView, "api-endpoint-models"),
    _at("models/<uuid:code>/probe", api.ProbeView, "api-probe"),
    _at("contestants", api.ContestantsView, "api-contestants"),
    _at("jobs", api.JobsView, "api-jobs"),
    _at("jobs/estimate", api.EstimateView, "api-job-estimate"),
    _at("jobs/<uuid:code>", api.JobView, "api-job"),
    _at("jobs/<uuid:code>/progress", api.JobProgressView, "job-progress"),
    _at("jobs/<uuid:code>/exports/<slug:name>.<slug:form>", exports.JobExportView, "api-job-file"),
    _at("studies", api.StudiesView, "api-studies"),
    _at("studies/<uuid:code>", api.StudyView, "api-study"),
    _at("studies/<uuid:code>/close", api.CloseStudyView, "api-study-close"),
    _at("studies/<uuid:code>/snapshots", api.SnapshotsView, "api-snapshots"),
    _at("snapshots/<uuid:code>", api.SnapshotView, "api-snapshot"),
    _at(
        "snapshots/<uuid:code>/exports/<slug:name>.<slug:form>",
        exports.SnapshotExportView,
        "api-snapshot-file",
    ),
    _at("matchups", api.MatchupsView, "api-matchups"),
    _at("pictures/<str:token>", api.ShownPictureView, "api-picture"),
    _at("preferences", api.PreferencesView, "api-preferences"),
    _at("reports", api.ReportsView, "api-reports"),
    _at("votes", api.VotesView, "api-votes"),
]
