"""Addresses of the pages."""

from __future__ import annotations

from django.contrib.auth import views as auth
from django.urls import URLPattern, path

from arena.contestants.pages import contestants, endpoints
from arena.contestants.pages import contestants as contestant_form
from arena.jobs.pages import displacement, driving, files, jobs, labelling
from arena.jobs.pages import jobs as job_actions
from arena.jobs.pages import launching as new_job
from arena.scenarios.pages import editing, prompts, scenarios, uploads
from arena.scenarios.pages import forms as scenario_form
from arena.scenarios.pages import scenarios as catalogue
from arena.scenarios.pages import scenarios as intents
from arena.scenarios.pages import scenarios as removing
from arena.scenarios.pages import uploads as scenes
from arena.web.people import accounts as people
from arena.web.people import api_tokens, authorships, enrolments, invitations
from arena.web.people.sign_in import SignIn
from arena.web.results import evidence as results_votes
from arena.web.results import files as results_files
from arena.web.results import pages as results
from arena.web.site import audit, health, home
from arena.web.studies import files as study_files
from arena.web.studies import pages as studies
from arena.web.studies import planning, reports, vote_uploads
from arena.web.studies import setup as study_setup
from arena.web.voting import pages as voting
from arena.web.voting import practice

urlpatterns: list[URLPattern] = [
    path("", home.home, name="home"),
    path("healthz", health.healthz, name="healthz"),
    path("readyz", health.readyz, name="readyz"),
    path("metrics", health.metrics, name="metrics"),
    path("theme/", home.theme, name="theme"),
    path("language/", home.language, name="language"),
    path("login/", SignIn.as_view(), name="login"),
    path("logout/", auth.LogoutView.as_view(), name="logout"),
    path("invitation/<str:token>/", invitations.invitation_page, name="invitation"),
    path("enrol/<str:token>/", enrolments.enrol_page, name="enrol"),
    path("first/<str:token>/", people.first_page, name="first"),
    path("welcome/<str:token>/", people.welcome_page, name="welcome"),
    path("password/", people.password_page, name="password"),
    path("tokens/", api_tokens.tokens_page, name="api-tokens"),
    path("tokens/<uuid:code>/revoke/", api_tokens.revoke, name="api-token-revoke"),
    path("people/", people.people_page, name="people"),
    path("people/<uuid:code>/link/", people.make_link, name="person-link"),
    path("people/<uuid:code>/change/", people.change_person, name="person-change"),
    path("people/<uuid:code>/forget/", people.forget_person, name="person-forget"),
    path("scenes/", scenes.scenes_page, name="scenes"),
    path("scenes/send/", uploads.send_file, name="scene-send"),
    path("scenes/<uuid:code>/", scenes.scene_page, name="scene"),
    path("uploads/<uuid:code>/", uploads.upload_page, name="upload"),
    path("uploads/<uuid:code>/show/", uploads.show_moment, name="upload-show"),
    path("uploads/<uuid:code>/again/", uploads.read_again, name="upload-again"),
    path("uploads/<uuid:code>/remove/", uploads.remove, name="upload-remove"),
    path("moments/<uuid:code>/keep/", uploads.keep_moment, name="moment-keep"),
    path("scenarios/", scenarios.scenarios_page, name="scenarios"),
    path("scenarios/load/", catalogue.load_scenarios, name="catalogue-load"),
    path("scenarios/bulk/", scenario_form.bulk_page, name="scenarios-bulk"),
    path("scenes/<uuid:code>/new/", scenario_form.new_scenario_page, name="scenario-new"),
    path("scenarios/<uuid:code>/prompts/", prompts.prompts_page, name="prompts"),
    path("scenarios/<uuid:code>/prompt.json", prompts.prompt_file, name="prompt-file"),
    path(
        "scenarios/<uuid:code>/prompts/<int:number>.png", prompts.prompt_image, name="prompt-image"
    ),
    path("scenarios/<uuid:code>/", scenarios.scenario_page, name="scenario"),
    path("scenarios/<uuid:code>/reference/", editing.reference_page, name="reference-edit"),
    path("scenarios/<uuid:code>/reference/drop/", editing.drop, name="reference-drop"),
    path("scenarios/<uuid:code>/check/", editing.check, name="edit-check"),
    path("scenarios/<uuid:code>/delete/", removing.delete_scenario_page, name="scenario-delete"),
    path("scenes/<uuid:code>/delete/", removing.delete_scene_page, name="scene-delete"),
    path("scenarios/<uuid:code>/retired/", removing.set_scenario_retired, name="scenario-retired"),
    path("scenes/<uuid:code>/retired/", removing.set_scene_retired, name="scene-retired"),
    path("scenes/<uuid:code>/slug/", removing.rename_scene_page, name="scene-rename"),
    path("scenarios/<uuid:code>/edit/", scenario_form.edit_page, name="scenario-edit"),
    path("scenarios/<uuid:code>/intent/fields/", scenario_form.intent_page, name="intent-edit"),
    path("scenarios/<uuid:code>/intent/", intents.set_intent, name="set-intent"),
    path("scenarios/<uuid:code>/read/", intents.read_instruction, name="intent-read"),
    path("scenarios/<uuid:code>/intent.json", intents.intent_file, name="intent"),
    path("pictures/<slug:kind>/<uuid:code>.png", scenarios.picture, name="picture"),
    path("contestants/", contestants.contestants_page, name="contestants"),
    path("contestants/new/", contestant_form.new_contestant_page, name="contestant-new"),
    path("contestants/<uuid:code>/", contestants.contestant_page, name="contestant"),
    path(
        "contestants/<uuid:code>/prompts/", prompts.contestant_prompts, name="contestant-prompts"
    ),
    path("contestants/<uuid:code>/retired/", contestants.set_retired, name="contestant-retired"),
    path("endpoints/", endpoints.endpoints_page, name="endpoints"),
    path("endpoints/new/", endpoints.new_endpoint_page, name="endpoint-new"),
    path("endpoints/<uuid:code>/", endpoints.endpoint_page, name="endpoint"),
    path("endpoints/<uuid:code>/models/", endpoints.add_model, name="endpoint-model-new"),
    path("models/<uuid:code>/", endpoints.model_page, name="endpoint-model"),
    path("models/<uuid:code>/probe/", endpoints.probe_model, name="endpoint-probe"),
    path("jobs/", jobs.jobs_page, name="jobs"),
    path("jobs/new/", new_job.new_job_page, name="job-new"),
    path("jobs/<uuid:code>/", jobs.job_page, name="job"),
    path("jobs/<uuid:code>/retry/", job_actions.retry_job, name="job-retry"),
    path("jobs/<uuid:code>/retry/<slug:key>/", job_actions.retry_cause, name="job-retry-cause"),
    path("jobs/<uuid:code>/pause/", job_actions.pause_job, name="job-pause"),
    path("jobs/<uuid:code>/cancel/", job_actions.cancel_job, name="job-cancel"),
    path("jobs/<uuid:code>/resume/", job_actions.resume_job, name="job-resume"),
    path(
        "jobs/<uuid:code>/displacement.<slug:form>",
        displacement.export,
        name="displacement-export",
    ),
    path("jobs/<uuid:code>/analyses/", files.analyses_page, name="analyses"),
    path(
        "jobs/<uuid:code>/analyses-<slug:part>.<slug:form>",
        files.export_analysis,
        name="analyses-export",
    ),
    path(
        "jobs/<uuid:code>/transcripts.jsonl", files.export_transcripts, name="transcripts-export"
    ),
    path(
        "jobs/<uuid:code>/tool-calls.<slug:form>", jobs.export_tool_calls, name="tool-calls-export"
    ),
    path(
        "jobs/<uuid:code>/scenarios-<slug:form>/", files.ask_for_scenarios, name="scenarios-write"
    ),
    path("scenarios-<uuid:code>.zip", files.download_scenarios, name="scenarios-export"),
    path("jobs/<uuid:code>/simulate/", driving.simulate_job, name="job-simulate"),
    path("jobs/<uuid:code>/drives/", driving.drives_page, name="drives"),
    path("jobs/<uuid:code>/driving.<slug:form>", driving.export, name="driving-export"),
    path("drives/<uuid:code>/", driving.drive_page, name="drive"),
    path("drives/<uuid:code>.<slug:form>", driving.drive_trace, name="drive-file"),
    path("jobs/<uuid:code>/faults/", labelling.faults_page, name="faults"),
    path("jobs/<uuid:code>/faults.<slug:form>", labelling.export, name="faults-export"),
    path("label/<uuid:code>/", labelling.label_page, name="label"),
    path("label/<uuid:code>/close/", labelling.close, name="labelling-close"),
    path("augmentations/<uuid:code>/", scenarios.augmentation_page, name="augmentation"),
    path("augmentations/<uuid:code>/correct/", editing.correct_page, name="correct"),
    path("augmentations/<uuid:code>/transcript.json", scenarios.transcript, name="transcript"),
    path("asked/<slug:digest>.png", scenarios.asked_image, name="asked-image"),
    path("audit/", audit.audit_page, name="audit"),
    path("audit.<slug:form>", audit.audit_file, name="audit-export"),
    path("studies/", studies.studies_page, name="studies"),
    path("studies/plan/", planning.planning_page, name="study-plan"),
    path("studies/checks/", study_setup.draw_checks, name="checks-draw"),
    path("studies/import/", vote_uploads.upload_votes_page, name="import-votes"),
    path("studies/new/", study_setup.new_study_page, name="study-new"),
    path("studies/drafts/<uuid:code>/", study_setup.draft_page, name="study-draft"),
    path("studies/drafts/<uuid:code>/discard/", study_setup.discard, name="study-draft-discard"),
    path("studies/<uuid:code>/", studies.study_page, name="study"),
    path("studies/<uuid:code>/again/", study_setup.use_again, name="study-again"),
    path("studies/<uuid:code>/cancel/", studies.cancel, name="study-cancel"),
    path(
        "studies/<uuid:code>/preregistration.json",
        studies.preregistration_file,
        name="preregistration",
    ),
    path("studies/<uuid:code>/experts/", invitations.experts_page, name="experts"),
    path("studies/<uuid:code>/enrolment/", enrolments.enrolment_page, name="enrolment"),
    path("studies/<uuid:code>/enrolment/drop/", enrolments.drop_out, name="enrolment-drop"),
    path(
        "studies/<uuid:code>/enrolment/voters.csv", enrolments.voters_file, name="enrolment-voters"
    ),
    path("studies/<uuid:code>/experts/invite/", invitations.invite_experts, name="invite"),
    path("invitations/<uuid:code>/revoke/", invitations.revoke_invitation, name="revoke"),
    path("studies/<uuid:code>/experts/authors/", authorships.mark, name="author"),
    path("authorships/<uuid:code>/take-back/", authorships.take_back, name="author-back"),
    path("studies/<uuid:code>/close/", studies.close, name="study-close"),
    path("studies/<uuid:code>/hand-over/", studies.hand_over_pairs, name="study-hand-over"),
    path("studies/<uuid:code>/reports/<uuid:key>/", reports.report_page, name="report"),
    path("studies/<uuid:code>/vote/", voting.vote_page, name="vote"),
    path("studies/<uuid:code>/vote/help/", voting.help_page, name="vote-help"),
    path("studies/<uuid:code>/vote/practice/", practice.practice_page, name="vote-practice"),
    path("studies/<uuid:code>/vote/skipped/", voting.skipped_page, name="vote-skipped"),
    path("studies/<uuid:code>/vote/report/", voting.report_pair, name="vote-report"),
    path("i/<str:token>", voting.matchup_image, name="matchup-image"),
    path("d/<uuid:code>", voting.replay, name="replay"),
    path("m/<uuid:code>", voting.measures, name="measures"),
    path("studies/<uuid:code>/results/", results.results_page, name="results"),
    path("studies/<uuid:code>/results/open/", results.open_results_early, name="results-open"),
    path("studies/<uuid:code>/results/votes/", results_votes.votes_page, name="results-votes"),
    path(
        "studies/<uuid:code>/results/votes.csv",
        results_votes.votes_file,
        name="results-votes-file",
    ),
    path(
        "studies/<uuid:code>/results/votes/<uuid:vote>/",
        results_votes.single_vote_page,
        name="results-vote",
    ),
    path(
        "studies/<uuid:code>/results/shown/<uuid:matchup>/<slug:side>.png",
        results_votes.shown_picture,
        name="shown-picture",
    ),
    path("studies/<uuid:code>/results/<slug:tab>/", results.results_page, name="results-tab"),
    path("studies/<uuid:code>/files/<slug:kind>/write/", study_files.ask, name="study-write"),
    path("studies/<uuid:code>/files/<slug:kind>/", study_files.download, name="study-file"),
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
