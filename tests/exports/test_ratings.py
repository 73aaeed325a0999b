import io
import json
from pathlib import Path
from typing import Any

import pytest
from django.core.management import CommandError, call_command
from django.urls import reverse

from arena.errors import NotYours, StudyStillOpen
from arena.models import Snapshot, Study, Vote
from arena.people.services import create_person
from arena.results.pages.tabs import describe
from arena.results.queries.access import ready_snapshots
from arena.results.services.ratings import (
    CLOSED_FORM_FROZEN,
    RATINGS,
    is_big,
    open_early,
    plan_snapshot,
)
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from arena.voting.queries.blinding import ResultsAccess, results_access
from arena.voting.services.simulation import simulate_votes
from augment.errors import Conflict
from augment.models import Augmentation, Event, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.board_rows import voted
from tests.opening import open_study
from tests.scenes import vehicle
from tests.study_rows import a_study, cast_of, expert, matchups_of, vote, vote_all
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def voted_study() -> Study:
    return voted(a_study(votes_per_expert=18))


def lines(snapshot: Snapshot) -> list[tuple[Any, ...]]:
    return list(
        snapshot.standings.order_by("-rating", "slug").values_list(
            "contestant__slug", "rank", "rating", "lower", "upper", "votes", "wins", "ties"
        )
    )


def test_the_same_votes_and_seed_give_the_same_standings() -> None:
    study = voted_study()
    one, again, other = (rate(study=study, seed=seed, unit="vote") for seed in (5, 5, 6))
    assert (lines(one), one.votes_sha256) == (lines(again), again.votes_sha256)
    assert lines(one) != lines(other)
    assert one.votes_sha256 == other.votes_sha256
    assert ready_snapshots(study).first() == other


@pytest.mark.parametrize("unit", [None, "vote", "expert"])
def test_two_experts_only_seem_to_prefer_and_single_votes_say_nothing(unit: str | None) -> None:
    found = rate(study=voted_study(), unit=unit)
    board, answer = found.results.board, describe(found, is_staff=True)["answer"]
    assert (board.above, board.p_values) == (None, None)
    assert (board.seems_above is None) == (unit is not None)
    is_said = "nobody is called better" in " ".join(board.warnings)
    assert is_said == (unit is not None)
    assert (answer == "Who is better is not judged with 36 votes.") == (unit is not None)
    has_places = found.standings.filter(rank_best__isnull=False).exists()
    assert has_places == (unit is None)


def test_an_open_study_is_rated_only_on_purpose_and_that_is_logged() -> None:
    study = a_study()
    with pytest.raises(StudyStillOpen, match="'Round 1' is still open"):
        rate(study=study)
    assert rate(study=study, early=True).is_early
    assert Event.objects.filter(verb="rate early").exists()


def test_who_may_see_results() -> None:
    study = a_study()
    eva = matchups_of(study, "eva")[0].expert
    gus, ana, adi = (
        create_person(username=role, password="a password", role=role)
        for role in ("expert", "researcher", "admin")
    )

    def access() -> list[str]:
        return [results_access(user=user, study=study) for user in (eva, gus, ana, adi)]

    none, early, full = ResultsAccess.NONE, ResultsAccess.EARLY, ResultsAccess.FULL
    assert access() == [none, none, early, early]
    study.experts.add(adi)
    assert access() == [none, none, early, early]
    open_early(study=study, actor=ana)
    assert access() == [none, none, full, early], "for whom it was opened"
    study = close_study(study=study)
    assert access() == [full, none, full, full]


def test_opening_results_early_is_logged_once_and_ends_voting() -> None:
    study = a_study()
    matchup = matchups_of(study, "eva")[0]
    for _ in range(2):
        open_early(study=study, actor=matchup.expert)
    logged = Event.objects.get(verb="look early")
    assert logged.after == {"what": "results", "ends_voting": True}
    with pytest.raises(NotYours):
        vote(matchup)
    with pytest.raises(Conflict, match="is closed: nothing is opened early"):
        open_early(study=close_study(study=study), actor=matchup.expert)


# --- Simulated votes ---------------------------------------------------------------------------


def change(x_m: float) -> dict[str, Any]:
    return modification_to_document(Modification(added=(vehicle("Agent2", x_m, 0.0),)))


def simulated_study(scenarios: int = 12) -> Study:
    """ann places the car right, bob 3 m off, cid answers nothing."""
    cast = cast_of(simulated_experts=True, scenarios=scenarios)
    Scenario.objects.update(reference=change(20.0))
    for slug, made in (("ann", change(20.1)), ("bob", change(23.0))):
        Augmentation.objects.filter(contestant__slug=slug).update(modification=made)
    Augmentation.objects.filter(contestant__slug="cid").update(
        modification=None, state="unreadable"
    )
    return open_study(
        name="Demo", votes_per_expert=3 * scenarios, seed=1, allow_simulated=True, **cast
    )


def test_simulated_experts_prefer_what_lies_nearer_the_reference(
    django_assert_max_num_queries: Any,
) -> None:
    study = simulated_study()
    with django_assert_max_num_queries(500):
        assert simulate_votes(study=study, seed=1) == 72
    assert Vote.objects.filter(is_simulated=True).count() == 72
    snapshot = rate(study=close_study(study=study))
    assert snapshot.includes_simulated
    assert [line[0] for line in lines(snapshot)] == ["ann", "bob", "cid"]
    assert Vote.objects.filter(outcome="equal").exists()


def test_simulated_votes_need_a_study_that_allows_them() -> None:
    study = a_study()
    with pytest.raises(Conflict, match="does not allow simulated votes"):
        simulate_votes(study=study, seed=1)
    demo = open_study(
        name="Demo",
        contestants=["ann", "bob"],
        scenarios=["place-0"],
        experts=["eva", expert("sim", is_simulated=True).username],
        votes_per_expert=1,
        seed=1,
        allow_simulated=True,
    )
    assert simulate_votes(study=demo, seed=1) == 1, "eva is a person"


def planned() -> Snapshot:
    return plan_snapshot(study=vote_all(a_study(votes_per_expert=3)), rounds=10)


def test_intervals_are_those_that_were_preregistered() -> None:
    study = planned().study
    assert study.snapshots.get().intervals == "bootstrap"
    frozen = study.preregistration.replace(
        "bootstrap with random effects of experts and of scenarios", CLOSED_FORM_FROZEN
    )
    assert frozen != study.preregistration
    study.preregistration = frozen
    chosen = [plan_snapshot(study=study, intervals=way).intervals for way in (None, "bootstrap")]
    assert chosen == ["closed", "bootstrap"]


def test_the_task_computes_what_was_planned_and_a_second_message_changes_nothing() -> None:
    snapshot = planned()
    assert not is_big(snapshot.study)
    for _ in range(2):
        RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.votes_counted) == (Snapshot.State.READY, 6)
    assert snapshot.standings.count() == 3
    RATINGS.perform(0)  # a row that is gone is no fault


def test_a_rating_that_breaks_in_an_unforeseen_way_says_so_and_can_be_asked_for_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    snapshot = planned()
    kept = snapshot.filters
    Snapshot.objects.filter(pk=snapshot.pk).update(filters={"kinds": 7})  # no list of words
    RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert snapshot.state == Snapshot.State.FAILED
    assert snapshot.reason.startswith("unexpected: ValidationError: ")
    assert f"snapshot {snapshot.pk}" in caplog.text
    assert "Traceback" in caplog.text
    event = Event.objects.get(verb="rating failed")
    assert event.after == {"snapshot": str(snapshot.code), "why": snapshot.reason}
    researcher = signed_in(people()["researcher"])
    page = researcher.get(reverse("results", args=[snapshot.study.code])).content.decode()
    assert "could not be computed: unexpected: ValidationError" in page
    assert reverse("rating-again", args=[snapshot.study.code, snapshot.code]) in page
    Snapshot.objects.filter(pk=snapshot.pk).update(filters=kept)
    researcher.post(reverse("rating-again", args=[snapshot.study.code, snapshot.code]))
    RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.reason != "", snapshot.progress) == ("ready", True, 100)


# --- By commands -------------------------------------------------------------------------------


def run(*arguments: object) -> str:
    out = io.StringIO()
    call_command(*[str(argument) for argument in arguments], stdout=out, stderr=io.StringIO())
    return out.getvalue()


def open_arguments() -> list[object]:
    cast = cast_of()
    shown = ["--contestants", *cast["contestants"], "--scenarios", *cast["scenarios"]]
    people = ["--experts", *cast["experts"], "--votes-per-expert", 6, "--seed", 1]
    return ["open_study", "Round 1", *shown, *people]


def test_a_study_is_opened_closed_rated_and_exported_by_commands(tmp_path: Path) -> None:
    assert "12 matchups for 2 experts" in run(*open_arguments())
    assert run("close_study", "Round 1") == "Closed 'Round 1'.\n"
    assert "There are no votes to rate." in run("rate", "Round 1")
    run("export", "leaderboard", "Round 1", "--format", "json", "--out", tmp_path / "board.json")
    assert json.loads((tmp_path / "board.json").read_text())["study"] == "Round 1"
    assert {path.name for path in tmp_path.iterdir()} == {"board.json", "media"}


def test_hypotheses_of_a_repeated_option_are_all_frozen() -> None:
    lines = ["Nobody is perfect.", "Nobody is alike.", "Nobody is last."]
    run(*open_arguments(), "--hypotheses", *lines[:2], "--hypotheses", lines[2])
    assert [one["text"] for one in Study.objects.get().rules["hypotheses"]] == lines


def test_a_hyphen_is_standard_output() -> None:
    run("rate", voted_study().name)
    assert run("export", "leaderboard", "Round 1", "--out", "-").startswith("rank,model,elo,")
    with pytest.raises(CommandError, match="name a file"):
        run("export", "leaderboard", "Round 1", "--format", "png", "--out", "-")
