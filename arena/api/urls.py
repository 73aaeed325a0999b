"""Addresses of the API, version 1."""

from __future__ import annotations

from django.urls import URLPattern, path

from arena.api import exports, reference
from arena.api.views import ApiView
from arena.contestants import api as contestants
from arena.contestants import api as endpoints
from arena.jobs import api as jobs
from arena.people import api
from arena.results import api as snapshots
from arena.scenarios import api as scenarios
from arena.scenarios import api as uploads
from arena.studies import api as studies
from arena.voting import api as voting


def _at(address: str, view: type[ApiView], name: str) -> URLPattern:
    found: URLPattern = path(address, view.as_view(), name=name)
    return found


urlpatterns: list[URLPattern] = [
    path("reference/", reference.reference_page, name="api-reference"),
    _at("openapi.json", reference.DocumentView, "api-document"),
    _at("people", api.PeopleView, "api-people"),
    _at("first", api.FirstView, "api-first"),
    _at("welcome", api.WelcomeView, "api-welcome"),
    _at("uploads", uploads.UploadsView, "api-uploads"),
    _at("uploads/<uuid:code>", uploads.UploadView, "api-upload"),
    _at("uploads/<uuid:code>/moments", uploads.MomentsView, "api-moments"),
    _at("moments/<uuid:code>", uploads.MomentView, "api-moment"),
    _at("moments/<uuid:code>/keep", uploads.KeepMomentView, "api-moment-keep"),
    _at("scenarios", scenarios.ScenariosView, "api-scenarios"),
    _at("endpoints", endpoints.EndpointsView, "api-endpoints"),
    _at("endpoints/<uuid:code>/models", endpoints.ModelsView, "api-endpoint-models"),
    _at("models/<uuid:code>/probe", endpoints.ProbeView, "api-probe"),
    _at("contestants", contestants.ContestantsView, "api-contestants"),
    _at("jobs", jobs.JobsView, "api-jobs"),
    _at("jobs/estimate", jobs.EstimateView, "api-job-estimate"),
    _at("jobs/<uuid:code>", jobs.JobView, "api-job"),
    _at("jobs/<uuid:code>/progress", jobs.JobProgressView, "job-progress"),
    _at("jobs/<uuid:code>/exports/<slug:name>.<slug:form>", exports.JobExportView, "api-job-file"),
    _at("studies", studies.StudiesView, "api-studies"),
    _at("studies/<uuid:code>", studies.StudyView, "api-study"),
    _at("studies/<uuid:code>/close", studies.CloseStudyView, "api-study-close"),
    _at("studies/<uuid:code>/snapshots", snapshots.SnapshotsView, "api-snapshots"),
    _at("snapshots/<uuid:code>", snapshots.SnapshotView, "api-snapshot"),
    _at(
        "snapshots/<uuid:code>/exports/<slug:name>.<slug:form>",
        exports.SnapshotExportView,
        "api-snapshot-file",
    ),
    _at("matchups", voting.MatchupsView, "api-matchups"),
    _at("pictures/<str:token>", voting.ShownPictureView, "api-picture"),
    _at("preferences", voting.PreferencesView, "api-preferences"),
    _at("reports", voting.ReportsView, "api-reports"),
    _at("votes", voting.VotesView, "api-votes"),
]
