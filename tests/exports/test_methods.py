"""The methods of a study: filled from what was frozen and rated, blank where that says nothing."""

import io
import json

import pytest
from django.core.management import call_command

from arena.models import Study
from arena.rating.lines import unshown_text
from arena.results.queries.votes import Filters
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study, preregistration_sha256
from arena.studies.services.taking_part import hand_over
from augment.models import Contestant, Scenario
from tests.board_rows import a_batch, a_board, newcomer, published, voted
from tests.opening import open_study
from tests.study_rows import a_study, cast_of, expert, matchups_of, shown_again, vote

pytestmark = pytest.mark.django_db


def exported(form: str, *more: str, study: str = "Round 1") -> str:
    out = io.StringIO()
    options = ("--format", form, "--out", "-", *more)
    call_command("export", "methods", study, *options, stdout=out)
    return out.getvalue()


def test_a_sheet_says_what_is_known_and_marks_the_rest() -> None:
    study = a_study(votes_per_expert=4)
    for name in ("eva", "finn"):
        shown = matchups_of(study, name)
        for matchup in (*shown, shown_again(shown[0])):
            vote(matchup)
    repeats = Filters(
        kinds=("main", "repeat"), experts=(str(study.experts.get(username="eva").person.code),)
    )
    early = rate(study=study, rounds=50, early=True, filters=repeats)
    study = close_study(study=study)
    text = exported("latex", "--rating", str(early.code))
    assert "On top came 2 hidden repeats; the repeats are rated as well" in text
    assert "; rated are only votes of 1 chosen expert." in text
    assert "seed 0, an early look: the study was still open)" in text
    call_command("rate", "Round 1", stdout=io.StringIO())
    sheet = json.loads(exported("json"))
    assert not sheet["early"]
    answers = {line["number"]: line["answer"] for line in sheet["questions"]}
    assert (answers["3.1.1"], answers["3.2.1"]) == ("6", "2")
    assert preregistration_sha256(study) in answers["3.3.1"]
    assert (answers["2.4"], answers["4.1.1"]) == ("English", "Correctness")
    assert answers["4.3.7"] == "Which image carries out the instruction better?"
    assert "Of 2 hidden repeats a share of 0.00" in answers["4.3.11"]
    assert answers["3.3.3"].startswith("On top came 2 hidden repeats; they are not rated")
    assert set(sheet["blank"]) >= {"1.1", "3.2.2", "3.2.3", "5.1"}
    assert list(sheet["versions"]) == sorted(sheet["versions"])
    assert all((answers[number] is None) == (number in sheet["blank"]) for number in answers)
    text = exported("latex")
    assert "Counted: 8 votes; left out: 2 hidden repeats." in text
    assert r"Recruitment: \textbf{[BLANK]}" in text
    assert "finn" not in text + json.dumps(sheet)


def test_one_pair_that_was_not_shown_is_told_in_the_singular() -> None:
    one = "1 pair that nobody can tell apart was not shown and"
    assert unshown_text(1, "a tie") == f"{one} counts as a tie"
    assert unshown_text(1, "") == f"{one} is left out"


def test_whether_both_miss_is_said_of_the_question_that_offers_it() -> None:
    study = a_study(votes_per_expert=4, questions=("instruction", "realism"))
    Study.objects.update(allow_both_miss=True)
    for matchup in matchups_of(study, "eva"):
        vote(matchup)
        vote(matchup, question="realism")
    study = close_study(study=study)
    for question, size in (("instruction", "3 + 1"), ("realism", "3")):
        rating = rate(study=study, rounds=50, filters=Filters(question=question))
        sheet = json.loads(exported("json", "--rating", str(rating.code)))
        answers = {line["number"]: line["answer"] for line in sheet["questions"]}
        assert answers["4.3.3"] == size
        assert ("both miss" in answers["4.3.4"]) == (question == "instruction")


def test_the_plan_tells_of_newcomers_and_of_what_came_later() -> None:
    board = a_board()
    published(board, 1)
    batch = a_batch(board, newcomer("dot").slug)
    hand_over(study=batch, username="finn", to=[expert("gus").username])
    Scenario.objects.exclude(slug="place-1").update(type="overtake_parked_vehicle")
    filters = Filters(types=("overtake_parked_vehicle",))
    rating = rate(study=voted(batch), rounds=100, filters=filters)
    text = exported("latex", "--rating", str(rating.code), study=batch.name)
    assert "compared 4 contestants on 5 scenarios" in text
    assert "; rated are only these types: Overtake parked vehicle" in text
    assert "each of 2 accounts, every pair with dot; 18 more were planned later" in text
    assert "left out: 6 not asked for." in text


def test_contestants_that_are_simulated_make_no_simulated_evaluators() -> None:
    cast = cast_of(kind=Contestant.Kind.SIMULATED)
    study = open_study(name="Round 1", votes_per_expert=4, seed=1, allow_simulated=True, **cast)
    rate(study=voted(study), rounds=100)
    assert "2 evaluators compared 3 contestants (3 simulated) on" in exported("latex")
