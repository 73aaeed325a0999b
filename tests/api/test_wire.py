"""Votes on the wire: what is stored, what is refused, all in one shape."""

import uuid
from datetime import timedelta
from typing import Any

import pytest
from django.contrib.auth.models import Group, User
from django.db import connection
from django.test import Client
from django.test.utils import CaptureQueriesContext
from django.utils import timezone
from pytest_django import Settings

from arena.models import Matchup, Report, Study, Vote
from arena.studies.services.opening import close_study
from arena.voting.queries.ballots import current_votes
from arena.voting.queries.keys import voting_switches
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.api.asking import body_for, error_of, post, signed_in
from tests.append_only import rewriting
from tests.scenes import vehicle
from tests.study_rows import a_study, expert, matchups_of

pytestmark = pytest.mark.django_db


def test_the_next_matchups_have_tokens_and_nothing_else(study: Study) -> None:
    study.matchups.update(original_image="bev/before.png", left_image="bev/before.png")
    response = signed_in("eva").get(f"/api/v1/matchups?study={study.code}")
    mine = matchups_of(study, "eva")[:4]
    assert response.json() == [
        {
            "matchup": str(matchup.code),
            "position": matchup.position,
            "question": "instruction",
            "instruction": matchup.scenario.instruction,
            "a": f"/i/{matchup.left_token}",
            "b": f"/i/{matchup.right_token}",
            "original": f"/i/{matchup.original_token}",
            "unchanged": ["a"],
            "is_filmed": False,
            **(matchup.view or {}),
        }
        for matchup in mine
    ]
    assert "no-store" in response["Cache-Control"]


def test_a_vote_is_stored_and_answered_with_what_comes_next(study: Study) -> None:
    client, mine = signed_in("eva"), matchups_of(study, "eva")
    for number, (letter, stored) in enumerate({"A": "left", "E": "equal", "B": "right"}.items()):
        answer = post(client, body_for(mine[number], letter, ms_visible=5100)).json()
        assert (answer["saved"], answer["skipped"], answer["total"]) == (number + 1, 0, 9)
        assert answer["next"][0]["matchup"] == str(mine[number + 1].code)
        assert len(answer["next"]) == 4
        kept = Vote.objects.latest("pk")
        assert (kept.matchup, kept.outcome, kept.ms_visible) == (mine[number], stored, 5100)


def test_the_same_key_again_is_answered_the_same_and_another_by_what_is_stored(
    study: Study,
) -> None:
    body = body_for(matchups_of(study, "eva")[0])
    client = signed_in("eva")
    first, again = post(client, body), post(client, body)
    assert (again.status_code, again.json()) == (200, first.json())
    error = error_of(post(client, body | {"key": str(uuid.uuid4())}), 409, "already_decided")
    assert error["outcome"] == "A"
    assert Vote.objects.count() == 1


def test_what_is_somebody_elses_answers_404_like_what_does_not_exist(study: Study) -> None:
    theirs = matchups_of(study, "finn")[0]
    client = signed_in("eva")
    real = error_of(post(client, body_for(theirs)), 404, "not_found")
    body = body_for(theirs, matchup=str(uuid.uuid4()))
    assert error_of(post(client, body), 404, "not_found") == real
    expert("gus")
    for code in (study.code, uuid.uuid4()):
        error_of(signed_in("gus").get(f"/api/v1/matchups?study={code}"), 404, "not_found")
    assert not Vote.objects.exists()


def test_a_closed_study_answers_410_and_still_confirms_what_it_has(study: Study) -> None:
    first, second, *_ = matchups_of(study, "eva")
    client = signed_in("eva")
    body = body_for(first)
    post(client, body)
    close_study(study=study)
    error_of(post(client, body_for(second)), 410, "study_not_open")
    error_of(client.get(f"/api/v1/matchups?study={study.code}"), 410, "study_not_open")
    answer = post(client, body).json()
    assert (answer["saved"], answer["total"], answer["next"]) == (1, 9, [])


def test_a_vote_says_all_that_an_expert_can_say(study: Study) -> None:
    Study.objects.update(allow_both_miss=True, ask_strength=True)
    first, second, third, *_ = matchups_of(study, "eva")
    client = signed_in("eva")
    said = {"both_miss": True, "comment": " Both off the road. ", "aids": ["ruler", "zoom"]}
    assert post(client, body_for(first, "E", n=1, **said)).json()["next"][0]["matchup"] == str(
        second.code
    )
    skipped = post(client, body_for(second, "skip", reason="picture_missing")).json()
    assert (skipped["saved"], skipped["skipped"]) == (1, 1), "a skip is no vote"
    post(client, body_for(third, "B", strength="slightly"))
    tie, skip, preference = Vote.objects.order_by("pk")
    assert (preference.outcome, preference.strength) == ("right", "slightly")
    assert (tie.both_miss, tie.comment, tie.aids) == (True, "Both off the road.", "zoom ruler")
    assert (skip.outcome, skip.reason, skip.winner_id) == ("skip", "picture_missing", None)


def test_a_vote_says_what_is_wrong_by_a_place_that_tells_no_id(study: Study) -> None:
    change = Modification(added=(vehicle("Zoe", 12.0, 1.0), vehicle("Amy", 5.0, -1.0)))
    Augmentation.objects.update(modification=modification_to_document(change))
    client, (first, *_) = signed_in("eva"), matchups_of(study, "eva")
    mark = {"side": "B", "object": 1, "fault": "heading"}
    refused = post(client, body_for(first, "A", faults=[mark]))
    assert "does not ask" in str(error_of(refused, 422, "invalid"))
    Study.objects.update(ask_why=True)
    answer = client.get(f"/api/v1/matchups?study={study.code}")
    view = first.view or {}
    (ego_x, ego_y), scale = view["ego_px"], view["px_per_m"]
    spots = [
        [pytest.approx(ego_x + scale * x, abs=0.1), pytest.approx(ego_y - scale * y, abs=0.1)]
        for x, y in ((5.0, -1.0), (12.0, 1.0))
    ]
    for side in "ab":  # from left to right, whatever their names
        assert [spot[:2] for spot in answer.json()[0]["objects"][side]] == spots
    assert not any(name in answer.content.decode() for name in ("Zoe", "Amy"))
    refused = post(client, body_for(first, "A", faults=[mark | {"object": 2}]))
    assert "2 on the left, 2 on the right" in str(error_of(refused, 422, "invalid"))
    body = body_for(first, "A", faults=[mark])
    assert post(client, body).status_code == post(client, body).status_code == 200
    assert Vote.objects.get().faults == [["right", "Zoe", "heading"]]
    assert post(client, body | {"faults": []}).status_code == 409
    # A vote that takes the place of another takes its marks away.
    post(client, body_for(first, "E", supersedes=body["key"]))
    assert current_votes(study).get().faults == []


def test_more_votes_than_a_person_can_give_are_refused(settings: Settings) -> None:
    settings.VOTES_PER_S = 1
    study = a_study()
    client = signed_in("eva")
    mine = matchups_of(study, "eva")
    bodies = [body_for(matchup) for matchup in mine]
    assert [post(client, body).status_code for body in bodies[:5]] == [200] * 5
    with rewriting(Vote):
        Vote.objects.update(at=timezone.now())  # also where five votes took their time
    refused = [post(client, body) for body in bodies[5:7]]
    assert [answer.status_code for answer in refused] == [429] * 2
    error_of(refused[0], 429, "too_fast")
    assert int(refused[0]["Retry-After"]) == 3
    assert Vote.objects.count() == 5, "what is refused is not stored"
    assert post(client, bodies[0]).status_code == 200, "a replay is no new vote"
    assert post(signed_in("finn"), body_for(matchups_of(study, "finn")[0])).status_code == 200
    with rewriting(Vote):
        Vote.objects.update(at=timezone.now() - timedelta(seconds=6))
    assert post(client, bodies[5]).status_code == 200


def test_a_vote_on_the_wire_costs_eight_queries_however_much_is_asked(study: Study) -> None:
    client = signed_in("eva")
    bodies = [body_for(matchup, ms_visible=5000) for matchup in matchups_of(study, "eva")]
    post(client, bodies[0])
    marks = ("SAVEPOINT", "RELEASE", "BEGIN", "COMMIT")  # not what a vote asks for
    for body, questions in ((bodies[1], ["instruction"]), (bodies[2], ["instruction", "realism"])):
        Study.objects.update(questions=questions)
        with CaptureQueriesContext(connection) as captured:
            coming = [one["matchup"] for one in post(client, body).json()["next"]]
        assert (body["matchup"] in coming) == (len(questions) > 1)
        asked = [query["sql"] for query in captured if not query["sql"].startswith(marks)]
        assert len(asked) == 8, asked


# --- Preferences and reports ---


def post_preferences(client: Client, body: object) -> Any:
    return client.post("/api/v1/preferences", body, content_type="application/json")


def test_a_switch_is_kept_and_the_others_stay(study: Study) -> None:
    client, eva = signed_in("eva"), User.objects.get(username="eva")
    assert post_preferences(client, {"legend": False}).json()["legend"] is False
    assert post_preferences(client, {"keep_zoom": True}).json() == voting_switches(eva)
    usual = {"single_keys": True, "rings": True}
    assert voting_switches(eva) == {**usual, "legend": False, "keep_zoom": True}
    assert post_preferences(client, {"legend": "no"}).status_code == 422


def test_a_report_is_kept_once_and_changes_no_vote(study: Study) -> None:
    matchup = matchups_of(study, "eva")[0]
    client = signed_in("eva")
    body = {
        "key": str(uuid.uuid4()),
        "matchup": str(matchup.code),
        "reason": "picture_wrong",
        "side": "B",
        "comment": "The truck is cut off.",
    }
    for _ in range(2):
        answer = client.post("/api/v1/reports", body, content_type="application/json")
        assert (answer.status_code, answer.json()) == (200, {"saved": True})
    kept = Report.objects.get()
    assert (kept.matchup, kept.reason, kept.comment) == (matchup, body["reason"], body["comment"])
    assert kept.side == "right"
    assert not Vote.objects.exists()


def test_a_pair_takes_so_many_reports_and_no_more(study: Study) -> None:
    """None is ever deleted, and staff get all of them on one page."""
    client, pairs = signed_in("eva"), matchups_of(study, "eva")

    def report(pair: Matchup, key: uuid.UUID) -> int:
        body = {"key": str(key), "matchup": str(pair.code), "reason": "other"}
        return client.post("/api/v1/reports", body, content_type="application/json").status_code

    keys = [uuid.uuid4() for _ in range(11)]
    assert [report(pairs[0], key) for key in keys] == [200] * 10 + [409]
    assert [report(pairs[0], keys[0]), report(pairs[1], keys[10])] == [200, 200]


def test_a_report_that_can_not_be_kept_says_why(study: Study) -> None:
    matchup = matchups_of(study, "eva")[0]
    body = {"key": str(uuid.uuid4()), "matchup": str(matchup.code), "reason": "other"}

    def send(whose: str, **changes: object) -> Any:
        sent = body | changes
        return signed_in(whose).post("/api/v1/reports", sent, content_type="application/json")

    error_of(send("finn"), 404, "not_found")
    wrong = {"reason": "dull", "side": "left", "vote": 1, "comment": "x" * 1001}
    for field, value in wrong.items():
        error_of(send("eva", **{field: value}), 422, "invalid")
    assert not Report.objects.exists()


WRONG: list[tuple[dict[str, object], str]] = [
    ({"outcome": "left"}, "outcome"), ({"outcome": None}, "outcome"),
    ({"key": "1"}, "key"), ({"key": 5}, "key"),
    ({"matchup": 5}, "matchup"), ({"matchup": None}, "matchup"),
    ({"supersedes": 5}, "supersedes"), ({"supersedes": "x"}, "supersedes"),
    ({"ms_visible": -1}, "ms_visible"), ({"ms_visible": "12"}, "ms_visible"),
    ({"ms_visible": 2**31}, "ms_visible"), ({"expert": "finn"}, "expert"),
    ({"outcome": "skip", "reason": "bored"}, "reason"),
    ({"reason": "\ud800"}, "reason"),
    ({"\ud800": 1}, "\ud800"), ({"n": 0}, "n"), ({"n": 13}, "n"),
    ({"outcome": "E", "both_miss": True}, "both_miss"), ({"both_miss": 1}, "both_miss"),
    ({"comment": "x" * 1001}, "comment"), ({"comment": 5}, "comment"),
    ({"aids": ["glasses"]}, "aids"), ({"aids": "zoom"}, "aids"),
]  # fmt: skip
"""What a body is changed by, and the field that is named then."""


def test_a_bad_body_or_query_is_answered_with_its_field(study: Study) -> None:
    client, first = signed_in("eva"), matchups_of(study, "eva")[0]
    for changes, field in WRONG:
        error = error_of(post(client, {**body_for(first), **changes}), 422, "invalid")
        assert list(error["fields"]) == [field], changes
    error = error_of(post(client, "[" * 100_000), 422, "invalid")
    assert "nested too deeply" in error["fields"]["body"][0]
    error_of(post(client, '{"key": "' + "x" * 3_000_000 + '"}'), 413, "too_large")
    for query in ("", "study=x", "study={code}&n=0", "study={code}&n=x", "study={code}&m=1"):
        address = f"/api/v1/matchups?{query.format(code=study.code)}"
        assert error_of(client.get(address), 422, "invalid")["fields"], query
    assert not Vote.objects.exists()


def test_strangers_other_sites_and_who_has_another_role_by_now_do_not_vote(study: Study) -> None:
    pairs, matchup = f"/api/v1/matchups?study={study.code}", matchups_of(study, "eva")[0]
    error_of(Client().get(pairs), 401, "signed_out")
    error_of(post(Client(), body_for(matchup)), 401, "signed_out")
    assert post_preferences(Client(), {}).status_code == 401
    elsewhere = Client(enforce_csrf_checks=True)
    elsewhere.force_login(matchup.expert)
    error_of(post(elsewhere, body_for(matchup)), 403, "forbidden")
    for role in ("researcher", "admin"):
        matchup.expert.groups.add(Group.objects.get_or_create(name=role)[0])
        client = signed_in("eva")
        error_of(post(client, body_for(matchup)), 403, "forbidden")
        error_of(client.get(pairs), 403, "forbidden")
    assert not Vote.objects.exists()
