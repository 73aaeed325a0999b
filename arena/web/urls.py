"""Addresses of the pages."""

from __future__ import annotations

from django.contrib.auth import views as auth
from django.urls import URLPattern, path

from arena.web import (
    authorships,
    displacement,
    home,
    invitations,
    jobs,
    labelling,
    results,
    results_files,
    results_votes,
    scenarios,
    studies,
    voting,
)
from arena.web.sign_in import SignIn

urlpatterns: list[URLPattern] = [
    path("", home.home, name="home"),
    path("theme/", home.theme, name="theme"),
    path("language/", home.language, name="language"),
    path("login/", SignIn.as_view(), name="login"),
    path("logout/", auth.LogoutView.as_view(), name="logout"),
    path("invitation/<str:token>/", invitations.invitation_page, name="invitation"),
    path("scenarios/", scenarios.scenarios_page, name="scenarios"),
    path("scenarios/<uuid:code>/", scenarios.scenario_page, name="scenario"),
    path("pictures/<slug:kind>/<uuid:code>.png", scenarios.picture, name="picture"),
    path("jobs/", jobs.jobs_page, name="jobs"),
    path("jobs/new/", jobs.new_job_page, name="job-new"),
    path("jobs/<uuid:code>/", jobs.job_page, name="job"),
    path("jobs/<uuid:code>/retry/", jobs.retry_job, name="job-retry"),
    path("jobs/<uuid:code>/cancel/", jobs.cancel_job, name="job-cancel"),
    path("jobs/<uuid:code>/resume/", jobs.resume_job, name="job-resume"),
    path(
        "jobs/<uuid:code>/displacement.<slug:form>",
        displacement.export,
        name="displacement-export",
    ),
    path("jobs/<uuid:code>/faults/", labelling.faults_page, name="faults"),
    path("jobs/<uuid:code>/faults.<slug:form>", labelling.export, name="faults-export"),
    path("label/<uuid:code>/", labelling.label_page, name="label"),
    path("label/<uuid:code>/close/", labelling.close, name="labelling-close"),
    path("augmentations/<uuid:code>/", scenarios.augmentation_page, name="augmentation"),
    path("augmentations/<uuid:code>/transcript.json", scenarios.transcript, name="transcript"),
    path("asked/<slug:digest>.png", scenarios.asked_image, name="asked-image"),
    path("studies/", studies.studies_page, name="studies"),
    path("studies/new/", studies.new_study_page, name="study-new"),
    path("studies/<uuid:code>/", studies.study_page, name="study"),
    path("studies/<uuid:code>/experts/", invitations.experts_page, name="experts"),
    path("studies/<uuid:code>/experts/invite/", invitations.invite_experts, name="invite"),
    path("invitations/<uuid:code>/revoke/", invitations.revoke_invitation, name="revoke"),
    path("studies/<uuid:code>/experts/authors/", authorships.mark, name="author"),
    path("authorships/<uuid:code>/take-back/", authorships.take_back, name="author-back"),
    path("studies/<uuid:code>/close/", studies.close, name="study-close"),
    path("studies/<uuid:code>/hand-over/", studies.hand_over_pairs, name="study-hand-over"),
    path("studies/<uuid:code>/vote/", voting.vote_page, name="vote"),
    path("studies/<uuid:code>/vote/help/", voting.help_page, name="vote-help"),
    path("studies/<uuid:code>/vote/report/", voting.report_pair, name="vote-report"),
    path("i/<str:token>", voting.matchup_image, name="matchup-image"),
    path("studies/<uuid:code>/results/", results.results_page, name="results"),
    path("studies/<uuid:code>/results/open/", results.open_results_early, name="results-open"),
    path("studies/<uuid:code>/results/votes/", results_votes.votes_page, name="results-votes"),
    path("studies/<uuid:code>/results/<slug:tab>/", results.results_page, name="results-tab"),
    path("studies/<uuid:code>/results.<slug:form>", results_files.export, name="results-export"),
    path(
        "studies/<uuid:code>/results-votes.<slug:form>",
        results_files.export_votes,
        name="results-votes-export",
    ),
    path(
        "studies/<uuid:code>/results-charts/<slug:name>.<slug:form>",
        results_files.export_chart,
        name="results-chart",
    ),
    path("studies/<uuid:code>/rate/", results.rate_study, name="study-rate"),
    path("studies/<uuid:code>/rate/<uuid:rating>/", results.compute_again, name="rating-again"),
]
