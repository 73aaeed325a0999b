"""Addresses of the pages of jobs, drives and fault labels."""

from django.urls import URLPattern, path

from arena.jobs.pages import jobs, labelling, launching, measures

JOB = "jobs/<uuid:code>"

urlpatterns: list[URLPattern] = [
    path("jobs/", jobs.jobs_page, name="jobs"),
    path("jobs/new/", launching.new_job_page, name="job-new"),
    path(f"{JOB}/", jobs.job_page, name="job"),
    path(f"{JOB}/retry/", jobs.retry_job, name="job-retry"),
    path(f"{JOB}/pause/", jobs.pause_job, name="job-pause"),
    path(f"{JOB}/cancel/", jobs.cancel_job, name="job-cancel"),
    path(f"{JOB}/resume/", jobs.resume_job, name="job-resume"),
    path(f"{JOB}/analyses/", measures.analyses_page, name="analyses"),
    path(f"{JOB}/transcripts.jsonl", measures.export_transcripts, name="transcripts-export"),
    path(f"{JOB}/files/<slug:name>.<slug:form>", measures.export_table, name="job-export"),
    path(f"{JOB}/scenarios-<slug:form>/", measures.ask_for_scenarios, name="scenarios-write"),
    path("scenarios-<uuid:code>.zip", measures.download_scenarios, name="scenarios-export"),
    path(f"{JOB}/simulate/", measures.simulate_job, name="job-simulate"),
    path(f"{JOB}/drives/", measures.drives_page, name="drives"),
    path("drives/<uuid:code>/", measures.drive_page, name="drive"),
    path("drives/<uuid:code>.json", measures.drive_trace, name="drive-file"),
    path(f"{JOB}/faults/", labelling.faults_page, name="faults"),
    path(f"{JOB}/<slug:tab>/", jobs.job_page, name="job-tab"),
    path("label/<uuid:code>/", labelling.label_page, name="label"),
    path("label/<uuid:code>/close/", labelling.close, name="labelling-close"),
]
