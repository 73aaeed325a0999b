"""Boards: a batch's pairs, what is pooled, and tables that stay as they were published."""

import csv
import json

import choix
import numpy as np
import pytest

from arena.errors import StudyStillOpen
from arena.models import Board, Matchup, Study, Vote
from arena.rating.board_table import BoardTableDocument
from arena.rating.snapshot_document import read_document
from arena.results.exports.board_files import board_folder
from arena.results.services.boards import make_board
from arena.results.services.ratings import rate_now
from arena.studies.queries import list_finished, scenario_sources
from arena.studies.services.opening import cancel_study
from arena.studies.services.planning import frozen_rules
from augment.errors import Conflict, UnknownName
from augment.models import Augmentation, Contestant, Event, Scenario
from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from tests.board_rows import a_batch, a_board, day, newcomer, published, voted
from tests.study_rows import picture

pytestmark = pytest.mark.django_db


@pytest.fixture
def board() -> Board:
    return a_board()


def test_over_three_dates_old_tables_stay_byte_for_byte(board: Board) -> None:
    published(board, 1)
    before = board_folder(board)
    for number, slug in ((2, "dot"), (3, "eli")):
        newcomer(slug)
        voted(a_batch(board, slug), seed=number)
        published(board, number)
        after = board_folder(board)
        old = {name for name in before if name.startswith("table-")}
        assert {name: after[name] for name in old} == {name: before[name] for name in old}
        assert after.keys() - before.keys() == {
            f"table-{number}.{form}" for form in ("json", "csv", "svg", "html")
        }
        before = after
    assert board_folder(board) == before
    assert [table.made_at for table in board.tables.order_by("number")] == [
        day(n) for n in (1, 2, 3)
    ]
    said = Event.objects.filter(object_kind="board").order_by("pk")
    assert [event.verb for event in said] == ["make", "publish", *["open batch", "publish"] * 2]
    document = board.tables.get(number=3).document
    assert {line.slug: line.since for line in document.lines} == {
        "ann": "2026-01-01",
        "bob": "2026-01-01",
        "cid": "2026-01-01",
        "dot": "2026-01-02",
        "eli": "2026-01-03",
    }
    assert [(one.votes, one.challengers) for one in document.studies] == [
        (36, ()),
        (36, ("dot",)),
        (36, ("eli",)),
    ]


def test_a_table_rates_the_pooled_votes_on_the_scale_of_the_first_study(board: Board) -> None:
    newcomer("dot")
    first = published(board, 1).document
    snapshot = rate_now(study=board.studies.get())
    assert first.votes_sha256 == snapshot.votes_sha256
    own = {row.slug: row.rating for row in snapshot.standings.all()}
    assert {line.slug: line.rating for line in first.lines} == pytest.approx(own)
    voted(a_batch(board, "dot"), seed=2)
    found = {line.slug: line.rating for line in published(board, 2).document.lines}
    assert found == pytest.approx(
        _elo_by_choix(["ann", "bob", "cid", "dot"], ["ann", "bob", "cid"])
    )
    assert np.mean([found[slug] or 0 for slug in ("ann", "bob", "cid")]) == pytest.approx(1000)


def test_a_table_marks_what_is_simulated_and_ties_that_nobody_was_shown(board: Board) -> None:
    study = board.studies.get()
    study.rules["identical"] = [["place-0", "ann", "bob"], ["place-1", "ann", "bob"]]
    study.allow_simulated = True
    study.save()
    Contestant.objects.filter(slug="cid").update(kind=Contestant.Kind.SIMULATED)
    table = published(board, 1)
    document = table.document
    ties = document.settled_ties or 0
    assert (document.votes, document.studies[0].votes) == (36, 36)
    assert {line.slug: line.settled_ties for line in document.lines} == {
        "ann": ties,
        "bob": ties,
        "cid": 0,
    }
    assert ties > 0
    rows = list(csv.DictReader(table.files["csv"].splitlines()))
    last = ["settled_ties", "remarks", "submitted", "withdrawn", "provisional"]
    assert list(rows[0])[-5:] == last
    assert {row["remarks"] for row in rows} == {" ".join(document.notes)}
    assert json.loads(table.files["json"])["includes_simulated"]
    assert {row["simulated"] for row in rows if row["slug"] == "cid"} == {"yes"}
    assert "Simulated votes and contestants count here" in table.files["html"]
    assert "(simulated)" in table.files["svg"]
    for row in rows:
        assert int(row["votes"]) == sum(int(row[name]) for name in ("wins", "ties", "losses"))
    assert sum(int(row["votes"]) for row in rows) == 72
    page = table.files["html"]
    assert f"36 votes and {ties} ties on pairs that nobody was shown" in page
    assert page.count(f" + {ties}</td>") == 2
    old = json.loads(table.files["json"])
    del old["settled_ties"], old["lines"][0]["settled_ties"]
    read = read_document(BoardTableDocument, old, what="board table")
    assert read.votes_text == "36 votes"


def _elo_by_choix(slugs: list[str], founders: list[str]) -> dict[str, float]:
    """Bradley-Terry of all votes by another package, a tie as half a win either way."""
    wins: list[tuple[int, int]] = []
    for row in Vote.objects.select_related("winner__contestant"):
        left, right = (
            slugs.index(one.contestant.slug) for one in (row.shown_left, row.shown_right)
        )
        if row.winner is None:
            wins += [(left, right), (right, left)]
        else:
            best = slugs.index(row.winner.contestant.slug)
            wins += 2 * [(best, left + right - best)]
    points = choix.opt_pairwise(len(slugs), wins, alpha=0.0, tol=1e-12) * 400 / np.log(10)
    level = np.mean([points[slugs.index(slug)] for slug in founders])
    return {slug: 1000 + point - level for slug, point in zip(slugs, points, strict=True)}


def test_every_pair_of_a_batch_has_a_newcomer_and_old_answers_are_shown_again(
    board: Board,
) -> None:
    published(board, 1)
    shown = set(Augmentation.objects.values_list("pk", flat=True))
    newcomer("dot")
    newcomer("eli")
    for place in Scenario.objects.all():  # a later answer of somebody who is rated
        picture(place, Contestant.objects.get(slug="ann"))
    batch = a_batch(board, "dot", "eli", votes=14)
    pairs = Matchup.objects.filter(study=batch).values_list(
        *("left__contestant__slug", "right__contestant__slug", "left", "right")
    )
    met: dict[frozenset[str], int] = {}
    for left, right, *augmentations in pairs:
        met[frozenset((left, right))] = met.get(frozenset((left, right)), 0) + 1
        olds = [
            key for slug, key in zip((left, right), augmentations, strict=True) if slug < "dot"
        ]
        assert set(olds) <= shown
    assert set(met) == {
        frozenset(pair)
        for pair in [
            ("dot", "eli"),
            *((new, old) for new in ("dot", "eli") for old in ("ann", "bob", "cid")),
        ]
    }
    assert set(met.values()) == {4}
    assert json.loads(batch.preregistration)["rules"]["challengers"] == ["dot", "eli"]
    assert frozen_rules(batch).challengers == ("dot", "eli")


def test_a_later_batch_shows_old_answers_even_where_a_newcomers_job_has_others(
    board: Board,
) -> None:
    published(board, 1)
    rated_by = set(Augmentation.objects.values_list("pk", flat=True))
    dot = newcomer("dot")
    for row in dot.augmentations.all():  # in the job of the newcomer, ann was asked anew
        again = picture(row.scenario, Contestant.objects.get(slug="ann"))
        Augmentation.objects.filter(pk=again.pk).update(job=row.job)
    voted(a_batch(board, "dot"), seed=2)
    published(board, 2)
    newcomer("eli")
    batch = a_batch(board, "eli")
    shown = Matchup.objects.filter(study=batch).values_list("left", "right")
    of_ann = Augmentation.objects.filter(contestant__slug="ann", pk__in={*sum(shown, ())})
    assert of_ann.exists()
    assert set(of_ann.values_list("pk", flat=True)) <= rated_by


def test_what_cannot_be_pooled_is_refused(board: Board) -> None:
    newcomer("dot")
    with pytest.raises(Conflict, match="first table"):
        a_batch(board, "dot")
    published(board, 1)
    with pytest.raises(Conflict, match="No study of the board was closed"):
        published(board, 2)
    with pytest.raises(UnknownName, match="ann"):
        a_batch(board, "ann")
    batch = a_batch(board, "dot")
    with pytest.raises(StudyStillOpen):
        published(board, 2)
    with pytest.raises(StudyStillOpen):
        a_batch(board, "dot")
    cancel_study(study=batch)
    with pytest.raises(Conflict, match="No study of the board was closed"):
        published(board, 2)
    Scenario.objects.filter(slug="place-1").update(instruction="Something else.")
    with pytest.raises(Conflict, match="scenarios and instructions"):
        a_batch(board, "dot")
    assert board.studies.count() == 2
    assert Study.objects.count() == 2


def test_a_board_over_a_benchmark_shows_just_its_test_split(board: Board) -> None:
    study = board.studies.get()
    whole, part = (
        make_benchmark(BenchmarkRequest(slug="city", title="City", scenarios=names, practice=0.0))
        for names in (["place-*"], ["place-1", "place-2"])
    )
    with pytest.raises(Conflict, match="test split of city@2"):
        make_board(name="Village", study=study, benchmark=part)
    table = published(make_board(name="Town", study=study, benchmark=whole), 1).document
    assert (table.benchmark, table.benchmark_sha256) == ("city@1", whole.checksum)
    sources = scenario_sources([])
    assert sources[f"benchmark:{part.code}"] == "Finished, test split of city@2"
    finished = list_finished(["ann", "bob"], f"benchmark:{part.code}")
    assert sorted(finished) == ["place-1", "place-2"]


def test_other_questions_are_not_pooled(board: Board) -> None:
    assert "carries out the instruction" in published(board, 1).document.question
    batch = voted(a_batch(board, newcomer("dot").slug))
    Study.objects.filter(pk=batch.pk).update(questions=["realism"])
    with pytest.raises(Conflict, match="asks something else"):
        published(board, 2)
