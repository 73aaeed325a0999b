"""Addresses of the pages."""

from django.contrib.auth import views as auth
from django.urls import URLPattern, path

from arena.contestants.urls import urlpatterns as CONTESTANTS
from arena.jobs.urls import urlpatterns as JOBS
from arena.people import pages as people
from arena.results.pages import boards, judges
from arena.results.pages import evidence as results_votes
from arena.results.pages import ratings as results
from arena.results.pages.comparison import comparison_page
from arena.scenarios.urls import urlpatterns as SCENARIOS
from arena.site import pages
from arena.studies.pages import experts, setup, studies
from arena.voting import pages as voting

STUDY = "studies/<uuid:code>"
RATING = f"{STUDY}/rating/<uuid:rating>"
SHARED_BOARD = "shared/boards/<str:token>"

urlpatterns: list[URLPattern] = [
    *SCENARIOS,
    *CONTESTANTS,
    *JOBS,
    path("", pages.home, name="home"),
    path("first-steps/<slug:name>/", pages.use_demo, name="first-step"),
    path("healthz", pages.healthz, name="healthz"),
    path("readyz", pages.readyz, name="readyz"),
    path("metrics", pages.metrics, name="metrics"),
    path("theme/", pages.choose, {"what": "theme"}, name="theme"),
    path("language/", pages.choose, {"what": "language"}, name="language"),
    path("login/", people.SignIn.as_view(), name="login"),
    path("logout/", auth.LogoutView.as_view(), name="logout"),
    path("invitation/<str:token>/", experts.invitation_page, name="invitation"),
    path("enrol/<str:token>/", experts.enrol_page, name="enrol"),
    path("first/", people.first_page, name="first"),
    path("first/<str:token>/", people.first_page, name="first"),
    path("welcome/<str:token>/", people.welcome_page, name="welcome"),
    path("password/", people.password_page, name="password"),
    path("tokens/", people.tokens_page, name="api-tokens"),
    path("tokens/<uuid:code>/revoke/", people.revoke_token, name="api-token-revoke"),
    path("people/", people.people_page, name="people"),
    path("people/<uuid:code>/link/", people.make_link, name="person-link"),
    path("people/<uuid:code>/change/", people.change_person, name="person-change"),
    path("people/<uuid:code>/forget/", experts.forget_person, name="person-forget"),
    path("audit/", pages.audit_page, name="audit"),
    path("studies/", studies.studies_page, name="studies"),
    path("studies/import/", setup.upload_votes_page, name="import-votes"),
    path("studies/new/", setup.set_up_page, name="study-new"),
    path("studies/drafts/<uuid:code>/", setup.set_up_page, name="study-draft"),
    path("studies/drafts/<uuid:code>/preview/", setup.preview_page, name="study-draft-preview"),
    path("studies/drafts/<uuid:code>/discard/", setup.discard, name="study-draft-discard"),
    path(f"{STUDY}/", studies.study_page, name="study"),
    path(f"{STUDY}/again/", setup.use_again, name="study-again"),
    path(f"{STUDY}/cancel/", studies.cancel, name="study-cancel"),
    path(f"{STUDY}/preregistration.json", studies.preregistration_file, name="preregistration"),
    path(f"{STUDY}/enrolment/", experts.enrolment_page, name="enrolment"),
    path(f"{STUDY}/enrolment/voters.csv", experts.voters_file, name="enrolment-voters"),
    path(f"{STUDY}/experts/invite/", experts.invite_experts, name="invite"),
    path("invitations/<uuid:code>/revoke/", experts.revoke_invitation, name="revoke"),
    path(f"{STUDY}/experts/authors/", experts.mark, name="author"),
    path(f"{STUDY}/close/", results.close_page, name="study-close"),
    path(f"{STUDY}/hand-over/", studies.hand_over_pairs, name="study-hand-over"),
    path(f"{STUDY}/vote/", voting.vote_page, name="vote"),
    path(f"{STUDY}/vote/practice/", voting.practice_page, name="vote-practice"),
    path(f"{STUDY}/vote/skipped/", voting.list_skipped_pairs, name="vote-skipped"),
    path("i/<str:token>", voting.matchup_image, name="matchup-image"),
    path("d/<uuid:code>", voting.replay, name="replay"),
    path(f"{STUDY}/results/", results.results_page, name="results"),
    path(f"{STUDY}/results/open/", results.open_results_early, name="results-open"),
    path(f"{STUDY}/results/votes/", results_votes.votes_page, name="results-votes"),
    path(f"{STUDY}/results/votes.csv", results_votes.votes_file, name="results-votes-file"),
    path(
        f"{STUDY}/results/shown/<uuid:matchup>/<slug:side>.png",
        results_votes.show_vote_picture,
        name="shown-picture",
    ),
    path(f"{STUDY}/results/compare/", comparison_page, name="results-compare"),
    path(f"{STUDY}/results/judges/", judges.judges_page, name="results-judges"),
    path(f"{STUDY}/results/judges/new/", judges.judge_start, name="judge-start"),
    path(f"{STUDY}/results/judges/<uuid:judge>/cancel/", judges.judge_cancel, name="judge-cancel"),
    path(f"{STUDY}/results/judges/<uuid:judge>.csv", judges.judge_answers, name="judge-answers"),
    path(f"{STUDY}/results/<slug:tab>/", results.results_page, name="results-tab"),
    path(f"{STUDY}/files/<slug:kind>/write/", studies.ask_for_file, name="study-write"),
    path(f"{STUDY}/files/<slug:kind>/", studies.download, name="study-file"),
    path(f"{STUDY}/rating/<slug:name>.<slug:form>", results.rating_file, name="results-export"),
    path(f"{RATING}/share/", results.share, {"is_shared": True}, name="results-share"),
    path(f"{RATING}/unshare/", results.share, {"is_shared": False}, name="results-unshare"),
    path("shared/<str:token>/", results.show_shared, name="shared-results"),
    path("shared/<str:token>/table.<slug:form>", results.send_shared, name="shared-file"),
    path("boards/", boards.boards_page, name="boards"),
    path("boards/<uuid:code>/", boards.board_page, name="board"),
    path("boards/<uuid:code>/export.zip", boards.board_export, name="board-export"),
    path("boards/<uuid:code>/publish/", boards.publish, name="board-publish"),
    path("boards/<uuid:code>/batch/", boards.start_batch, name="board-batch"),
    path("boards/<uuid:code>/share/", boards.share, {"is_shared": True}, name="board-share"),
    path("boards/<uuid:code>/unshare/", boards.share, {"is_shared": False}, name="board-unshare"),
    path("boards/<uuid:code>/<int:number>.<slug:form>", boards.board_file, name="board-file"),
    path(f"{SHARED_BOARD}/", boards.show_board, name="shared-board"),
    path(f"{SHARED_BOARD}/<int:number>.<slug:form>", boards.send_table, name="shared-board-file"),
    path(f"{STUDY}/rate/", results.rate_study, name="study-rate"),
    path(f"{STUDY}/rate/<uuid:rating>/", results.compute_again, name="rating-again"),
]
