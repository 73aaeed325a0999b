"""An expert's pairs are handed over while the expert and the takers vote, on either database."""

import threading
import uuid
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor

import pytest
from django.conf import LazySettings
from django.contrib.auth.models import User
from django.db import connection

from arena.errors import NothingToPlan, NotYours
from arena.models import Matchup, Report, Study, Vote
from arena.studies.services.taking_part import hand_over
from arena.voting.services.casting import Decision, receive_vote
from arena.voting.services.reports import Complaint, report
from augment.models import Event
from tests.study_rows import a_study, matchups_of

pytestmark = pytest.mark.django_db(transaction=True)

GIVER, TAKERS = "eva", ("finn", "gus")
THREADS = 6
PATIENCE_S = 120.0

Pairs = Counter[tuple[str, ...]]


@pytest.fixture(autouse=True)
def _no_pace(settings: LazySettings) -> None:
    settings.VOTES_PER_S = 1_000_000
    settings.VOTE_WAIT_S = 60  # a busy machine is no busy database


@pytest.fixture
def study() -> Study:
    """Thirty votes each, with hidden repeats on top."""
    return a_study(experts=(GIVER, *TAKERS), scenarios=30, votes_per_expert=30)


class Ballots:
    """Votes as browsers send them, and what became of each."""

    def __init__(self) -> None:
        self.stored: list[uuid.UUID] = []
        self.refused: list[uuid.UUID] = []
        self.first_ones = threading.Event()

    def cast(self, expert: User, matchup: Matchup) -> None:
        """One vote in whatever thread; gone is what was handed over in the meantime."""
        decision = Decision(matchup=matchup.code, key=uuid.uuid4(), outcome="left")
        try:
            receive_vote(expert=expert, decision=decision)
        except NotYours:
            self.refused.append(matchup.code)
        else:
            self.stored.append(matchup.code)
        if len(self.stored) >= 4:
            self.first_ones.set()

    def cast_all(self, expert: User, matchups: Iterable[Matchup]) -> None:
        """In one thread, one after the other."""
        try:
            for matchup in matchups:
                self.cast(expert, matchup)
        finally:
            connection.close()


def handed_over(study: Study, ballots: Ballots, taken: list[dict[str, int]]) -> None:
    """As soon as the first votes are there."""
    assert ballots.first_ones.wait(PATIENCE_S)
    try:
        taken.append(hand_over(study=study, username=GIVER, to=TAKERS))
    except NothingToPlan:
        taken.append({})
    finally:
        connection.close()


def votes_by_pair(study: Study) -> Pairs:
    """How many votes every pair is to get from all experts."""
    rows = study.matchups.filter(kind=Matchup.Kind.MAIN).values_list(
        "left__contestant__slug", "right__contestant__slug"
    )
    return Counter(tuple(sorted(row)) for row in rows)


def all_done(work: Iterable[Future[None]]) -> None:
    for one in work:
        one.result(timeout=PATIENCE_S)


def is_bound(row: Matchup) -> bool:
    """Whether something else is about the pair: a report, or a vote on its repeat."""
    again = getattr(row, "repeated_by", None)
    return row.reports.exists() or (again is not None and again.votes.exists())


def check(study: Study, ballots: Ballots, before: Pairs, taken: dict[str, int]) -> None:
    voted = Counter(Vote.objects.values_list("matchup__code", flat=True))
    assert voted == Counter(ballots.stored), "no vote is lost, none doubled, none of refused ones"
    assert not Matchup.objects.filter(code__in=ballots.refused).exists()
    assert votes_by_pair(study) == before, "every pair keeps its votes"
    open_ones = study.matchups.filter(expert__username=GIVER, votes=None)
    assert [row.code for row in open_ones if not is_bound(row)] == []
    given = study.matchups.filter(expert__username=GIVER, kind=Matchup.Kind.MAIN).count()
    assert given + sum(taken.values()) == study.votes_per_expert
    for name in TAKERS:
        own = [row for row in matchups_of(study, name) if row.kind == Matchup.Kind.MAIN]
        assert len(own) == study.votes_per_expert + taken.get(name, 0)
        units = [(row.scenario_id, frozenset((row.left_id, row.right_id))) for row in own]
        assert len(set(units)) == len(units), "nobody judges a unit twice"


def test_votes_and_a_hand_over_at_once_add_up(study: Study) -> None:
    """The giver's come out of order and on several connections, as no browser sends them."""
    before, ballots, taken = votes_by_pair(study), Ballots(), list[dict[str, int]]()
    eva, own = study.experts.get(username=GIVER), matchups_of(study, GIVER)
    with ThreadPoolExecutor(max_workers=THREADS + 3) as pool:
        work = [
            pool.submit(ballots.cast_all, eva, own[thread::THREADS]) for thread in range(THREADS)
        ]
        for expert in study.experts.exclude(username=GIVER):
            pairs = matchups_of(study, expert.username)
            work.append(pool.submit(ballots.cast_all, expert, pairs))
        all_done([*work, pool.submit(handed_over, study, ballots, taken)])
    check(study, ballots, before, taken[0])
    for name in TAKERS:
        left = study.matchups.filter(expert__username=name, votes=None).order_by("position")
        ballots.cast_all(study.experts.get(username=name), list(left))
    assert not study.matchups.filter(votes=None).exists()
    counted = Vote.objects.filter(matchup__kind=Matchup.Kind.MAIN).count()
    assert counted == 3 * study.votes_per_expert, "the study ends with all its votes"


def test_two_hand_overs_at_once_share_out_every_vote_once(study: Study) -> None:
    before, ballots, taken = votes_by_pair(study), Ballots(), list[dict[str, int]]()
    ballots.first_ones.set()
    with ThreadPoolExecutor(max_workers=2) as pool:
        all_done([pool.submit(handed_over, study, ballots, taken) for _ in range(2)])
    assert sorted(map(bool, taken)) == [False, True], "the second finds nothing left"
    check(study, ballots, before, {**taken[0], **taken[1]})
    assert Event.objects.filter(verb="hand over").count() == 1


def test_a_report_at_the_same_time_keeps_its_pair(study: Study) -> None:
    """Whichever is first: the report is about a pair that stays, or the pair is gone."""
    eva, own = study.experts.get(username=GIVER), matchups_of(study, GIVER)
    ballots, taken = Ballots(), list[dict[str, int]]()
    kept: list[uuid.UUID] = []

    def report_all(rows: list[Matchup]) -> None:
        try:
            for row in rows:
                report(
                    expert=eva,
                    complaint=Complaint(key=uuid.uuid4(), matchup=row.code, reason="other"),
                )
                kept.append(row.code)
                ballots.first_ones.set()
        except NotYours:
            pass
        finally:
            connection.close()

    with ThreadPoolExecutor(max_workers=THREADS + 1) as pool:
        work = [pool.submit(report_all, own[thread::THREADS]) for thread in range(THREADS)]
        all_done([*work, pool.submit(handed_over, study, ballots, taken)])
    assert Counter(Report.objects.values_list("matchup__code", flat=True)) == Counter(kept)
    left = {row.code for row in matchups_of(study, GIVER)}
    assert set(kept) <= left
