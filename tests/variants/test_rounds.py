"""Reviews and rounds: who is asked in which order, what counts in the end, what is on record."""

import pytest

from augment.llm.messages import Reply
from augment.variants.pipeline import OutcomeStatus
from tests.intents import parked
from tests.variants.playing import Play, car, questions, rating, verdict

LOW, HIGH = rating(2, 3, 2, "It is too near."), rating(4, 4, 4)
SEEN = "1. In Lane1.\n2. cannot see\n3. Yes."


def test_a_mean_below_four_sends_the_feedback_back() -> None:
    play = Play("tqa", [car(15.0), rating(5, 3, 3, "It is too near."), car(21.4), HIGH])
    assert (play.roles, play.x_m) == ("mrmr", 21.4)
    again = play.client.requests[2].messages
    assert [message.speaker for message in again] == ["system", "user", "assistant", "user"]
    assert again[2].text == car(15.0)
    assert "- It is too near. Reason: Because. Corrective action: Move it." in again[3].text


def test_the_best_rated_of_three_rounds_counts_and_each_is_on_record() -> None:
    rounds = [car(10.0), rating(2, 2, 2, "a"), car(20.0), rating(3, 4, 4, "b"), car(30.0)]
    play = Play("tqa", [*rounds, rating(1, 1, 1, "c")])
    assert (play.roles, play.x_m, play.outcome.is_accepted) == ("mrmrmr", 20.0, False)
    assert [note["round"] for note in play.notes("round")] == [1, 2, 3]
    assert [note["mean"] for note in play.notes("review")] == [2.0, 3.6667, 1.0]
    assert play.notes("kept") == [{"round": 2, "rounds": 3, "accepted": False, "remark": ""}]
    assert "round 2 of 3 counts" in play.outcome.notes
    assert "No round was accepted." in play.outcome.notes


@pytest.mark.parametrize(
    "ratings",
    [
        rating("four", 4, 4),
        rating(4.5, 4, 4),
        rating(True, 4, 4),
        rating(6, 4, 4),
        rating(0, 4, 4),
        rating(None, 4, 4),
        rating(2, 2, 2),  # nothing that the modifier could be told
        "All is well.",
        "",
    ],
)
def test_ratings_that_are_none_are_asked_for_once_more(ratings: str) -> None:
    play = Play("tqa", [car(21.4), ratings, HIGH])
    assert (play.roles, play.outcome.is_accepted) == ("mrr", True)


@pytest.mark.parametrize(
    ("variant", "review"), [("tqa", [HIGH]), ("vqa", [questions(), SEEN, verdict()])]
)
def test_reviewers_are_told_why_a_wish_is_refused(variant: str, review: list[str]) -> None:
    play = Play(variant, ["I can't: no lane comes the other way.", *review])
    assert play.outcome.status is OutcomeStatus.REFUSED
    told = play.client.requests[1].messages[-1].text
    assert "> I can't: no lane comes the other way." in told
    accepted = Play(variant, [car(21.4), *review])
    assert "refuses" not in accepted.client.requests[1].messages[-1].text


def test_an_unusable_review_lets_the_modifiers_result_stand() -> None:
    play = Play("tqa", [car(21.4), "Fine.", "Really fine."])
    assert (play.outcome.status, play.outcome.is_accepted) == (OutcomeStatus.DONE, None)
    assert "The review is unusable: the reviewer: there is no fenced" in play.outcome.notes
    assert "unusable" in play.notes("review")[0]


def test_a_later_review_that_fails_leaves_the_newest_round() -> None:
    play = Play("tqa", [car(10.0), LOW, car(20.0), "Fine.", "Fine."])
    assert play.x_m == 20.0


def test_a_regeneration_that_can_not_be_read_leaves_the_round_before() -> None:
    play = Play("tqa", [car(10.0), LOW, "There.", "There."])
    assert (play.roles, play.x_m, play.outcome.is_accepted) == ("mrmm", 10.0, False)
    assert "Round 2 brought no modification" in play.outcome.notes


def test_engineer_viewer_engineer_and_an_accepted_round_ends_it() -> None:
    play = Play("vqa", [car(21.4), questions(), SEEN, verdict()])
    assert (play.roles, play.outcome.is_accepted) == ("meve", True)
    viewed = play.client.requests[2].messages[-1]
    assert viewed.images[0].startswith(b"\x89PNG")
    assert "1. Where is Agent2?" in viewed.text
    assert "Add a parked car" not in viewed.text
    weighed = play.client.requests[3].messages
    assert [one.speaker for one in weighed] == ["system", "user", "assistant", "user"]
    assert "> 2. Where is Agent3? -> cannot see" in weighed[-1].text


def test_without_an_accepted_round_the_last_counts_and_is_marked() -> None:
    def turn(x_m: float) -> list[str]:
        return [car(x_m), questions(), SEEN, verdict("No.")]

    play = Play("vqa", [*turn(10.0), *turn(20.0), *turn(30.0)])
    assert (play.roles, play.x_m, play.outcome.is_accepted) == ("meve" * 3, 30.0, False)
    assert "No round was accepted." in play.outcome.notes


def test_a_visual_review_that_fails_is_unusable() -> None:
    for script, roles in (
        ([questions(2), questions(9)], "mee"),
        ([questions(), "I see a car.", "A car."], "mevv"),
        ([questions(), SEEN, verdict(said="feedback"), verdict("Bad.", said="accept")], "mevee"),
        ([questions(), Reply(text="", refusal="No picture.")], "mev"),
        ([questions(), Reply(text="", finish_reason="content_filter")], "mev"),
    ):
        play = Play("vqa", [car(21.4), *script])
        assert (play.roles, play.outcome.status) == (roles, OutcomeStatus.DONE)
        assert play.outcome.is_accepted is None
        assert "The review is unusable" in play.outcome.notes


def test_measured_facts_go_back_and_no_model_reviews() -> None:
    play = Play("geo", [car(21.4, y_m=30.0), car(21.4)])
    assert (play.roles, play.x_m, play.outcome.is_accepted) == ("mm", 21.4, True)
    told = play.client.requests[1].messages[-1].text
    assert told.startswith("Your placement was measured against the map.")
    assert "- Wrong: 100% of Agent2 is outside the drivable area" in told
    findings = play.notes("review")[0]["findings"]
    assert isinstance(findings, list)
    assert {"kind", "severity", "agents", "sentence"} == findings[0].keys()


def test_a_modifier_that_insists_on_what_is_only_doubtful_has_the_last_word() -> None:
    kerb = car(21.4, y_m=-1.5)
    play = Play("geo", [kerb, kerb])
    assert (play.roles, play.outcome.is_accepted) == ("mm", True)
    assert "0 findings wrong" in play.outcome.notes


def test_a_geometric_review_holds_the_modification_against_the_intent_where_there_is_one() -> None:
    far = car(29.4)
    play = Play("geo", [far, car(21.4)], intent=parked(21.4))
    assert (play.roles, play.x_m, play.outcome.is_accepted) == ("mm", 21.4, True)
    told = play.client.requests[1].messages[-1].text
    assert "ego's lane is 29.40 m; 21.4 m is asked for" in told
    assert Play("geo", [far]).outcome.is_accepted is True
