"""Votes of authors on their own contestants: left out on demand, and always shown both ways."""

import io
import json
import zipfile
from typing import Any

import pytest
from django.contrib.auth.models import User
from hypothesis import given
from hypothesis import strategies as st

from arena.exports.files import zip_bytes
from arena.models import Snapshot, Study
from arena.pairing.order import MAIN
from arena.people.links import mark_author
from arena.rating.leaderboard import rate as rate_votes
from arena.rating.snapshot_document import OwnVotes
from arena.results.exports.writers import bundle_files
from arena.results.queries.votes import Entrant, Filters, Judged, VoteSet
from arena.results.services.analysis import vote_arrays
from arena.results.services.ratings import rate_now as rate
from arena.results.services.ratings import votes_of
from arena.results.services.trust import OTHER_ROUNDS, with_and_without
from augment.models import Event
from tests.full_study import Size, full_study

pytestmark = pytest.mark.django_db

SIZE = Size(scenarios=8, experts=4, votes_per_expert=90)
AUTHOR, OWN = "expert-1", "gpt-4o-otm"
WITHOUT = Filters(leave_out_own=True)


@pytest.fixture
def study() -> Study:
    return full_study(size=SIZE)


def mark(study: Study, username: str = AUTHOR, slug: str = OWN) -> None:
    mark_author(study=study, expert=User.objects.get(username=username), contestant=slug)


def code_of(username: str) -> str:
    return str(User.objects.get(username=username).person.code)


def table_of(snapshot: Snapshot) -> dict[str, tuple[Any, ...]]:
    return {row.slug: (row.rank, row.rating, row.votes) for row in snapshot.standings.all()}


def shown(snapshot: Snapshot, version: str) -> dict[str, tuple[Any, ...]]:
    return {
        line.slug: (getattr(line, f"rank_{version}"), getattr(line, f"rating_{version}"))
        for line in own_votes(snapshot).lines
    }


def own_votes(snapshot: Snapshot) -> OwnVotes:
    assert snapshot.results.own_votes is not None
    return snapshot.results.own_votes


def zipped(snapshot: Snapshot) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(zip_bytes(bundle_files(snapshot)))) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_they_count_unless_a_rating_leaves_them_out_and_are_counted_by_reason(
    study: Study,
) -> None:
    plain = rate(study=study, rounds=50)
    mark(study)
    counted = rate(study=study, rounds=50)
    assert "authors" not in str(Event.objects.filter(verb="rate").latest("pk").after)
    assert (counted.votes_sha256, table_of(counted)) == (plain.votes_sha256, table_of(plain))
    left = rate(study=study, rounds=50, filters=WITHOUT)
    own = left.votes_left_out["own"]
    assert own > 0
    assert left.votes_counted == counted.votes_counted - own
    assert left.votes_sha256 != counted.votes_sha256
    assert not any(
        vote.judge == code_of(AUTHOR) and OWN in (vote.left, vote.right)
        for vote in votes_of(left).counted
    )
    assert any(vote.judge == code_of(AUTHOR) for vote in votes_of(left).counted)


def test_the_zip_has_both_versions_but_never_who_is_author(study: Study) -> None:
    mark(study)
    snapshot = rate(study=study, rounds=20, filters=WITHOUT)
    files = zipped(Snapshot.objects.get(pk=snapshot.pk))
    manifest, statistics = (json.loads(files[f"{n}.json"]) for n in ("manifest", "statistics"))
    assert manifest["filters"]["leave_out_own"] is True
    assert manifest["filters"]["authors"] == 1
    assert manifest["votes"]["left_out"] == snapshot.votes_left_out
    assert statistics["own_votes"]["votes"] == snapshot.votes_left_out["own"]
    assert len(statistics["own_votes"]["lines"]) == 9
    assert "by_judge" not in statistics["own_votes"]
    texts = b"".join(files[name] for name in files if not name.endswith(".pdf"))
    assert code_of(AUTHOR).encode() not in texts


# --- Properties --------------------------------------------------------------------------------

SLUGS, JUDGES = "abc", "xyz"
PAIRS = [(left, right) for left in SLUGS for right in SLUGS if left != right]


@st.composite
def judged(draw: st.DrawFn) -> tuple[Judged, ...]:
    cells = draw(
        st.lists(
            st.tuples(
                st.sampled_from(PAIRS),
                st.sampled_from(JUDGES),
                st.sampled_from("12"),
                st.sampled_from(("left", "equal", "right")),
            ),
            min_size=1,
            max_size=25,
        )
    )
    return tuple(
        Judged(
            judge=judge,
            judge_name=judge,
            item=item,
            type="nudge",
            kind=MAIN,
            left=left,
            right=right,
            outcome=outcome,
            both_miss=False,
            is_simulated=False,
            ms_visible=None,
            matchup=number,
            repeat_of=None,
        )
        for number, ((left, right), judge, item, outcome) in enumerate(cells)
    )


AUTHORS = st.frozensets(st.tuples(st.sampled_from(JUDGES), st.sampled_from(SLUGS)), max_size=4)


def a_vote_set(votes: tuple[Judged, ...], filters: Filters) -> VoteSet:
    counted = tuple(
        one
        for one in votes
        if not (filters.leave_out_own and filters.is_own(one.judge, one.left, one.right))
    )
    return VoteSet(
        entrants=tuple(
            Entrant(slug=s, name=s, variant="", kind="rule", is_simulated=False, contestant=None)
            for s in SLUGS
        ),
        counted=counted,
        with_own=votes,
        repeats=(),
        checks=(),
        references=frozenset(),
        left_out={},
    )


def compared(votes: tuple[Judged, ...], filters: Filters) -> OwnVotes | None:
    found = a_vote_set(votes, filters)
    board = rate_votes(vote_arrays(found.entrants, found.counted).comparisons, rounds=30, seed=1)
    return with_and_without(found, filters, board)


@given(votes=judged(), authors=AUTHORS)
def test_leaving_out_no_one_changes_nothing(
    votes: tuple[Judged, ...], authors: frozenset[tuple[str, str]]
) -> None:
    strangers = frozenset((f"not {judge}", slug) for judge, slug in authors)
    for pairs in (frozenset[tuple[str, str]](), strangers):
        for leave_out in (False, True):
            filters = Filters(leave_out_own=leave_out, authors=pairs)
            assert compared(votes, filters) is None
            assert a_vote_set(votes, filters).counted == votes


@given(votes=judged(), authors=AUTHORS)
def test_both_ratings_say_the_same_of_both_versions(
    votes: tuple[Judged, ...], authors: frozenset[tuple[str, str]]
) -> None:
    one, other = (
        compared(votes, Filters(leave_out_own=leave_out, authors=authors))
        for leave_out in (False, True)
    )
    if one is None or other is None:
        assert one is other
        return
    assert one.lines == other.lines
    assert one.largest == other.largest
    assert one.rounds == min(30, OTHER_ROUNDS)
    assert 0 < one.votes <= len(votes)
