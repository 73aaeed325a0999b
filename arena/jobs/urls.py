"""Addresses of the pages of jobs, drives and fault labels."""

from django.urls import URLPattern, path

from arena.jobs.pages import jobs, labelling, launching, measures

urlpatterns: list[URLPattern] = [
    path("jobs/", jobs.jobs_page, name="jobs"),
    path("jobs/new/", launching.new_job_page, name="job-new"),
    path("jobs/<uuid:code>/", jobs.job_page, name="job"),
    path("jobs/<uuid:code>/retry/", jobs.retry_job, name="job-retry"),
    path("jobs/<uuid:code>/pause/", jobs.pause_job, name="job-pause"),
    path("jobs/<uuid:code>/cancel/", jobs.cancel_job, name="job-cancel"),
    path("jobs/<uuid:code>/resume/", jobs.resume_job, name="job-resume"),
    path("jobs/<uuid:code>/analyses/", measures.analyses_page, name="analyses"),
    path(
        "jobs/<uuid:code>/transcripts.jsonl",
        measures.export_transcripts,
        name="transcripts-export",
    ),
    path(
        "jobs/<uuid:code>/files/<slug:name>.<slug:form>", measures.export_table, name="job-export"
    ),
    path(
        "jobs/<uuid:code>/scenarios-<slug:form>/",
        measures.ask_for_scenarios,
        name="scenarios-write",
    ),
    path("scenarios-<uuid:code>.zip", measures.download_scenarios, name="scenarios-export"),
    path("jobs/<uuid:code>/simulate/", measures.simulate_job, name="job-simulate"),
    path("jobs/<uuid:code>/drives/", measures.drives_page, name="drives"),
    path("drives/<uuid:code>/", measures.drive_page, name="drive"),
    path("drives/<uuid:code>.json", measures.drive_trace, name="drive-file"),
    path("jobs/<uuid:code>/faults/", labelling.faults_page, name="faults"),
    path("jobs/<uuid:code>/<slug:tab>/", jobs.job_page, name="job-tab"),
    path("label/<uuid:code>/", labelling.label_page, name="label"),
    path("label/<uuid:code>/close/", labelling.close, name="labelling-close"),
]
