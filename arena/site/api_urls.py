"""Addresses of the API, version 1."""

from django.urls import URLPattern, path

from arena.api.views import ApiView, DocumentView
from arena.contestants import api as contestants
from arena.jobs import api as jobs
from arena.people import api as people
from arena.results import api as results
from arena.scenarios import api as scenarios
from arena.studies import api as studies
from arena.voting import api as voting


def _at(address: str, view: type[ApiView], name: str) -> URLPattern:
    pattern: URLPattern = path(address, view.as_view(), name=name)
    return pattern


urlpatterns: list[URLPattern] = [
    _at("openapi.json", DocumentView, "api-document"),
    _at("people", people.PeopleView, "api-people"),
    _at("first", people.FirstView, "api-first"),
    _at("welcome", people.WelcomeView, "api-welcome"),
    _at("uploads", scenarios.UploadsView, "api-uploads"),
    _at("uploads/<uuid:code>", scenarios.UploadView, "api-upload"),
    _at("uploads/<uuid:code>/moments", scenarios.MomentsView, "api-moments"),
    _at("moments/<uuid:code>", scenarios.MomentView, "api-moment"),
    _at("submissions", scenarios.SubmissionsView, "api-submissions"),
    _at("submissions/<uuid:code>", scenarios.SubmissionView, "api-submission"),
    _at("scenarios", scenarios.ScenariosView, "api-scenarios"),
    _at("scenarios/<uuid:code>/sweeps", scenarios.SweepsView, "api-sweeps"),
    _at("scenarios/<uuid:code>/family", scenarios.FamilyView, "api-family"),
    _at("sweeps/<uuid:code>", scenarios.SweepView, "api-sweep"),
    _at("endpoints", contestants.EndpointsView, "api-endpoints"),
    _at("endpoints/<uuid:code>/models", contestants.ModelsView, "api-endpoint-models"),
    _at("models/<uuid:code>/probe", contestants.ProbeView, "api-probe"),
    _at("contestants", contestants.ContestantsView, "api-contestants"),
    _at("jobs", jobs.JobsView, "api-jobs"),
    _at("jobs/estimate", jobs.EstimateView, "api-job-estimate"),
    _at("jobs/<uuid:code>", jobs.JobView, "api-job"),
    _at("jobs/<uuid:code>/progress", jobs.JobProgressView, "job-progress"),
    _at("jobs/<uuid:code>/exports/<slug:name>.<slug:form>", jobs.JobExportView, "api-job-file"),
    _at("augmentations/<uuid:code>", jobs.AugmentationView, "api-augmentation"),
    _at("augmentations/<uuid:code>/follow-ups", jobs.FollowUpsView, "api-follow-ups"),
    _at("studies", studies.StudiesView, "api-studies"),
    _at("studies/<uuid:code>", studies.StudyView, "api-study"),
    _at("studies/<uuid:code>/close", studies.CloseStudyView, "api-study-close"),
    _at("studies/<uuid:code>/snapshots", results.SnapshotsView, "api-snapshots"),
    _at("snapshots/<uuid:code>", results.SnapshotView, "api-snapshot"),
    _at(
        "snapshots/<uuid:code>/exports/<slug:name>.<slug:form>",
        results.SnapshotExportView,
        "api-snapshot-file",
    ),
    _at("matchups", voting.MatchupsView, "api-matchups"),
    _at("pictures/<str:token>", voting.ShownPictureView, "api-picture"),
    _at("preferences", voting.PreferencesView, "api-preferences"),
    _at("reports", voting.ReportsView, "api-reports"),
    _at("votes", voting.VotesView, "api-votes"),
]
