"""The lists of votes behind the numbers of a rating: the database marks them as the rating did."""

from collections import Counter

import pytest
from django.db.models import F

from arena.models import Snapshot, Study, Vote
from arena.results.queries.evidence import each_vote, vote_page
from arena.results.queries.search import EVERY, LEFT_OUT, VoteSearch, find_votes
from arena.results.queries.votes import Filters
from arena.results.services.ratings import rate_now as rate
from augment.scene.entities import ScenarioType
from tests.mixed_study import mixed_study

pytestmark = pytest.mark.django_db


@pytest.fixture
def study() -> Study:
    return mixed_study()


def rated(study: Study, **filters: object) -> Snapshot:
    return rate(study=study, rounds=10, filters=Filters(**filters))  # type: ignore[arg-type]


def total(snapshot: Snapshot, **search: str) -> int:
    return vote_page(snapshot, VoteSearch(**search), 1).paginator.count


CHOICES: dict[str, dict[str, object]] = {
    "all": {},
    "one type": {"types": (ScenarioType.OVERTAKE.value,)},
    "with repeats": {"kinds": ("main", "repeat")},
    "repeats alone": {"kinds": ("repeat",)},
    "without settled pairs": {"leave_out_settled": True},
    "one nudge": {"types": (ScenarioType.NUDGE.value,)},
    "without own": {"leave_out_own": True},
}


@pytest.mark.slow
@pytest.mark.parametrize("allow_simulated", [True, False])
def test_the_database_gives_the_reasons_of_the_rating(study: Study, allow_simulated: bool) -> None:
    study.allow_simulated = allow_simulated
    study.save()
    for choice, filters in CHOICES.items():
        snapshot = rated(study, **filters)
        every = VoteSearch(mark=EVERY)
        marks = Counter(find_votes(snapshot, every).values_list(F("mark"), flat=True))
        for vote in each_vote(snapshot, every):
            if vote.vote is None and vote.mark != "automatic":
                marks[vote.mark] += 1
        assert marks.pop("counted", 0) == total(snapshot) == snapshot.votes_counted, choice
        left_out = snapshot.votes_left_out
        assert dict(marks) == left_out, choice
        assert total(snapshot, mark=LEFT_OUT) == sum(left_out.values()), choice
        assert {reason: total(snapshot, mark=reason) for reason in left_out} == left_out, choice


def test_what_comes_after_a_rating_is_none_of_its_votes(study: Study) -> None:
    before = rated(study)
    held = total(before, mark=EVERY)
    first = Vote.objects.order_by("pk")[0]
    shown = {"shown_left": first.shown_left, "shown_right": first.shown_right}
    who = {"matchup": first.matchup, "expert": first.expert}
    Vote.objects.create(key=first.matchup.code, outcome="equal", supersedes=first, **shown, **who)
    assert total(before, mark=EVERY) == held
    assert total(before, mark="superseded") == before.votes_left_out["superseded"] == 2
    assert total(rated(study), mark="superseded") == 3


def test_every_number_of_standings_pairs_and_raters_is_a_search(study: Study) -> None:
    study.allow_simulated = True
    study.save()
    snapshot = rated(study)
    for line in snapshot.standings.all():
        for outcome, number in (("won", line.wins), ("tied", line.ties), ("lost", line.losses)):
            assert total(snapshot, contestant=line.slug, outcome=outcome) == number
    for pair in snapshot.results.pairs:
        search = {"contestant": pair.a, "opponent": pair.b}
        for outcome, number in (("won", pair.wins), ("tied", pair.ties), ("lost", pair.losses)):
            assert total(snapshot, outcome=outcome, **search) == number
        assert total(snapshot, outcome="both_miss", **search) == pair.both_miss
    for part in snapshot.results.types:
        assert total(snapshot, type=part.type) == part.votes
    for rater in snapshot.results.trust.raters:
        assert total(snapshot, expert=rater.judge) == rater.votes
        answered, _ = rater.checks
        every = {"expert": rater.judge, "mark": EVERY}
        assert total(snapshot, part="checks", **every | {"mark": "check"}) == answered
        skipped = rater.checks_skipped
        assert total(snapshot, outcome="skip", **every | {"mark": "check"}) == skipped
        repeated, _ = rater.repeats
        assert total(snapshot, part="repeats", **every) == repeated
    kept = snapshot.results.trust.repeats
    assert total(snapshot, part="repeats", mark=EVERY) == kept.number == 6


def test_pages_hold_every_vote_once_and_automatic_ties_at_the_end(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("arena.results.queries.evidence.PER_PAGE", 7)
    study.allow_simulated = True
    study.save()
    snapshot = rated(study)
    search = VoteSearch()
    pages = [vote_page(snapshot, search, number) for number in range(1, 5)]
    assert [page.number for page in pages] == [1, 2, 3, 4]
    assert {page.paginator.num_pages for page in pages} == {4}
    listed = [vote for page in pages for vote in page]
    every = [(vote.given, vote.mark) for vote in each_vote(snapshot, search)]
    assert [(vote.given, vote.mark) for vote in listed] == every
    assert len(listed) == snapshot.votes_counted == 24
    assert [vote.vote is None for vote in listed].index(True) == 22
    assert vote_page(snapshot, search, 99).number == 4
