"""Addresses of the wire, version 1."""

from __future__ import annotations

from django.urls import URLPattern, path

from arena.api import (
    augmentations,
    contestants,
    endpoints,
    exports,
    job_actions,
    jobs,
    matchups,
    people,
    pictures,
    preferences,
    reference,
    reports,
    scenarios,
    simulations,
    snapshots,
    studies,
    votes,
)
from arena.api.errors import ApiView


def _at(address: str, view: type[ApiView], name: str) -> URLPattern:
    found: URLPattern = path(address, view.as_view(), name=name)
    return found


urlpatterns: list[URLPattern] = [
    path("reference/", reference.reference_page, name="api-reference"),
    _at("openapi.json", reference.DocumentView, "api-document"),
    _at("account", people.AccountView, "api-account"),
    _at("people", people.PeopleView, "api-people"),
    _at("first", people.FirstView, "api-first"),
    _at("welcome", people.WelcomeView, "api-welcome"),
    _at("catalogue", scenarios.CatalogueView, "api-catalogue"),
    _at("scenarios", scenarios.ScenariosView, "api-scenarios"),
    _at("scenarios/<uuid:code>", scenarios.ScenarioView, "api-scenario"),
    _at("scenarios/<uuid:code>/picture", pictures.ScenarioPictureView, "api-scenario-picture"),
    _at("endpoints", endpoints.EndpointsView, "api-endpoints"),
    _at("contestants", contestants.ContestantsView, "api-contestants"),
    _at("contestants/<uuid:code>", contestants.ContestantView, "api-contestant"),
    _at("contestants/<uuid:code>/retired", contestants.RetirementView, "api-contestant-retired"),
    _at("jobs", jobs.JobsView, "api-jobs"),
    _at("jobs/estimate", jobs.EstimateView, "api-job-estimate"),
    _at("jobs/<uuid:code>", jobs.JobView, "api-job"),
    _at("jobs/<uuid:code>/progress", jobs.JobProgressView, "job-progress"),
    _at("jobs/<uuid:code>/cancel", job_actions.CancelJobView, "api-job-cancel"),
    _at("jobs/<uuid:code>/failures", job_actions.FailuresView, "api-job-failures"),
    _at("jobs/<uuid:code>/pause", job_actions.PauseJobView, "api-job-pause"),
    _at("jobs/<uuid:code>/retry", job_actions.RetryJobView, "api-job-retry"),
    _at("jobs/<uuid:code>/resume", job_actions.ResumeJobView, "api-job-resume"),
    _at("jobs/<uuid:code>/exports/<slug:name>.<slug:form>", exports.JobExportView, "api-job-file"),
    _at("augmentations", augmentations.AugmentationsView, "api-augmentations"),
    _at("augmentations/<uuid:code>", augmentations.AugmentationView, "api-augmentation"),
    _at(
        "augmentations/<uuid:code>/picture",
        pictures.AugmentationPictureView,
        "api-augmentation-picture",
    ),
    _at("augmentations/<uuid:code>/transcript", augmentations.TranscriptView, "api-transcript"),
    _at("simulations", simulations.SimulationsView, "api-simulations"),
    _at("simulations/<uuid:code>", simulations.SimulationView, "api-simulation"),
    _at(
        "simulations/<uuid:code>/file.<slug:form>",
        simulations.SimulationFileView,
        "api-simulation-file",
    ),
    _at("scenario-files", exports.ScenarioFilesView, "api-scenario-files"),
    _at("scenario-files/<uuid:code>", exports.ScenarioFileView, "api-scenario-file"),
    _at(
        "scenario-files/<uuid:code>/content",
        exports.ScenarioFileContentView,
        "api-scenario-file-content",
    ),
    _at("studies", studies.StudiesView, "api-studies"),
    _at("studies/<uuid:code>", studies.StudyView, "api-study"),
    _at("studies/<uuid:code>/close", studies.CloseStudyView, "api-study-close"),
    _at("studies/<uuid:code>/early-look", studies.EarlyLookView, "api-early-look"),
    _at("studies/<uuid:code>/snapshots", snapshots.SnapshotsView, "api-snapshots"),
    _at("snapshots/<uuid:code>", snapshots.SnapshotView, "api-snapshot"),
    _at(
        "snapshots/<uuid:code>/exports/<slug:name>.<slug:form>",
        exports.SnapshotExportView,
        "api-snapshot-file",
    ),
    _at("matchups", matchups.MatchupsView, "api-matchups"),
    _at("pictures/<str:token>", pictures.ShownPictureView, "api-picture"),
    _at("preferences", preferences.PreferencesView, "api-preferences"),
    _at("reports", reports.ReportsView, "api-reports"),
    _at("votes", votes.VotesView, "api-votes"),
]
