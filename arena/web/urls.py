"""Addresses of the pages."""

from __future__ import annotations

from django.contrib.auth import views as auth
from django.urls import URLPattern, path

from arena.web import displacement, home, jobs, labelling, results, scenarios, studies, voting

urlpatterns: list[URLPattern] = [
    path("", home.home, name="home"),
    path("theme/", home.theme, name="theme"),
    path(
        "login/",
        auth.LoginView.as_view(template_name="login.html", redirect_authenticated_user=True),
        name="login",
    ),
    path("logout/", auth.LogoutView.as_view(), name="logout"),
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
    path("augmentations/<uuid:code>/", scenarios.augmentation_page, name="augmentation"),
    path("augmentations/<uuid:code>/transcript.json", scenarios.transcript, name="transcript"),
    path("asked/<slug:digest>.png", scenarios.asked_image, name="asked-image"),
    path("studies/", studies.studies_page, name="studies"),
    path("studies/new/", studies.new_study_page, name="study-new"),
    path("studies/<uuid:code>/", studies.study_page, name="study"),
    path("studies/<uuid:code>/close/", studies.close, name="study-close"),
    path("studies/<uuid:code>/vote/", voting.vote_page, name="vote"),
    path("i/<str:token>", voting.matchup_image, name="matchup-image"),
    path("studies/<uuid:code>/results/", results.results_page, name="results"),
    path("studies/<uuid:code>/results.<slug:form>", results.export, name="results-export"),
    path("studies/<uuid:code>/rate/", results.rate_study, name="study-rate"),
]
