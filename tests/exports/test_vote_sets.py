"""Which votes a rating is made of, and what it keeps of them."""

import csv
import io
import json
from datetime import datetime
from typing import Any

import pandas as pd
import pytest
from django.contrib.auth.models import User
from django.core.management import CommandError, call_command
from django.template.loader import render_to_string
from pyarrow import parquet

from arena.exports.files import sha256_hex
from arena.models import Snapshot, Study, Vote
from arena.people.links import mark_author
from arena.rating.vote_columns import COLUMNS
from arena.results.api import SnapshotDocument
from arena.results.exports.preferences import PREFERENCE_FORMATS, preference_sheet
from arena.results.exports.tables import leaderboard_table, method_text
from arena.results.exports.votes import VOTE_FORMATS, vote_table
from arena.results.exports.writers import FORMATS, RATING_FILES, bundle_files, plain_text
from arena.results.pages.tabs import TABS
from arena.results.queries.evidence import count_settled
from arena.results.queries.votes import Filters, last_vote_id, vote_set
from arena.results.services.ratings import plan_snapshot, read_votes
from arena.results.services.ratings import rate_now as rate
from arena.results.services.vote_files import vote_rows, votes_csv
from arena.studies.services.opening import close_study
from augment.errors import Conflict
from augment.models import Event, Scenario
from augment.scene.entities import ScenarioType
from tests.append_only import rewriting
from tests.board_rows import voted
from tests.study_rows import a_study, matchups_of, shown_again, vote, vote_all

pytestmark = pytest.mark.django_db


def counted(study: Study, **filters: object) -> list[str]:
    found = vote_set(study, filters=Filters(**filters), last=last_vote_id(study))  # type: ignore[arg-type]
    return [f"{one.item} {one.left} {one.right} {one.outcome}" for one in found.counted]


def test_filters_choose_by_type_and_expert_and_count_what_they_leave_out() -> None:
    study = a_study(votes_per_expert=6)
    Scenario.objects.filter(slug="place-0").update(type=ScenarioType.OVERTAKE)
    for matchup in study.matchups.all():
        vote(matchup)
    eva = matchups_of(study, "eva")[0].expert.person
    wanted = study.matchups.filter(scenario__slug="place-0").count()
    assert len(counted(study)) == 12
    assert len(counted(study, types=(ScenarioType.OVERTAKE.value,))) == wanted > 0
    assert len(counted(study, experts=(str(eva.code),))) == 6
    found = vote_set(study, filters=Filters(experts=(str(eva.code),)), last=last_vote_id(study))
    assert found.left_out == {"filtered": 6}


def test_votes_after_the_frozen_one_do_not_count_nor_supersede() -> None:
    study = a_study(votes_per_expert=2)
    first, second = matchups_of(study, "eva")
    old = vote(first, "left")
    last = last_vote_id(study)
    vote(first, "right", supersedes=old.key)
    vote(second, "left")
    found = vote_set(study, filters=Filters(), last=last)
    assert [one.outcome for one in found.counted] == ["left"]
    assert found.left_out == {}


@pytest.mark.usefixtures("no_charts")
def test_settled_pairs_are_ties_of_experts_but_no_judgements_of_theirs() -> None:
    study = a_study(votes_per_expert=6)
    study.rules["identical"] = [[f"place-{n}", "ann", "bob"] for n in range(6)]
    study.save()
    for matchup in study.matchups.all():
        vote(matchup, "equal")
    voted = study.matchups.count()
    close_study(study=study)
    study.refresh_from_db()
    whole, alone = (
        rate(study=study, filters=Filters(leave_out_settled=left_out), intervals="closed")
        for left_out in (False, True)
    )
    settled = whole.votes_counted - voted
    assert alone.votes_counted == voted
    for rating, ties in ((whole, settled), (alone, 0)):
        _check_that_ties_stand_apart(rating, voted, ties)
    assert settled == pytest.approx(6 * voted / study.scenarios.count() / 3, abs=6)
    assert whole.results.board.experts == alone.results.board.experts
    for name in ("agreement", "side"):
        assert getattr(whole.results.trust, name) == getattr(alone.results.trust, name)
    said = f"6 pairs that nobody can tell apart were not shown and count as {settled} ties"
    assert any(said in warning for warning in whole.results.board.warnings)
    assert any("are left out" in warning for warning in alone.results.board.warnings)
    assert "seed" not in method_text(plan_snapshot(study=study, intervals="closed"))
    assert "seed 0" in method_text(plan_snapshot(study=study))
    assert "seed 0" in method_text(plan_snapshot(study=study, unit="vote", method="elo"))
    planned = {frozenset((pair.a, pair.b)): pair for pair in whole.results.pairs}
    assert planned[frozenset(("ann", "bob"))].planned == planned[frozenset(("ann", "bob"))].votes


def _check_that_ties_stand_apart(rating: Snapshot, voted: int, ties: int) -> None:
    """Check every file, page and document: the votes of people, and beside them unshown ties."""
    table = leaderboard_table(rating)
    both = f"{voted} votes" + (f" and {ties} ties on pairs that nobody was shown" if ties else "")
    assert count_settled(rating) == ties
    assert f"{both} counted; left out" in plain_text(table)
    latex = FORMATS["latex"].write(table).decode()
    assert f"; {both}, 2 experts, 6 scenarios. The mean of models" in latex
    assert f"Rating {rating.code} of {rating.made_at:%Y-%m-%d}.}}" in latex
    assert "seed" not in latex
    lines = list(csv.DictReader(io.StringIO(FORMATS["csv"].write(table).decode())))
    assert list(lines[0])[-2:] == ["settled_ties", "votes_sha256"]
    document = json.loads(FORMATS["json"].write(table))
    assert (document["votes"]["counted"], document["votes"]["settled_ties"]) == (voted, ties)
    listed = SnapshotDocument(rating).data
    assert (listed["votes"], listed["settled_ties"]) == (voted, ties)
    for rows in (lines, document["standings"], listed["table"]["rows"]):
        assert sum(int(row["votes"]) for row in rows) == 2 * voted
        assert sum(int(row["settled_ties"]) for row in rows) == 2 * ties
        for row in rows:
            parts = (int(row[name]) for name in ("wins", "ties", "losses"))
            assert sum(parts) == int(row["votes"])
    assert {line["votes_sha256"] for line in lines} == {rating.votes_sha256}
    files = RATING_FILES["all"].make(rating)
    pairs, types = (
        list(csv.DictReader(files[name].decode().splitlines()))
        for name in ("pairs.csv", "types.csv")
    )
    assert {list(row)[-1] for row in (*pairs, *types)} == {"settled_ties"}
    assert sum(int(row["ties"]) for row in pairs) == voted
    assert sum(int(row["votes"]) for row in types) == 2 * voted
    assert sum(int(row["settled_ties"]) for row in pairs) == ties
    assert sum(int(row["settled_ties"]) for row in types) == 2 * ties
    drawn = {"snapshot": rating, "study": rating.study}
    pages = {name: TABS[name](rating, table) | drawn for name in ("pairs", "types")}
    for name, marks in (("pairs", 2), ("types", 3)):
        page = render_to_string(f"results/{name}.html", pages[name])
        assert page.count(f" + {ties}") == (marks if ties else 0)
    (part,) = pages["types"]["parts"]
    assert sum(row.votes_cast for row in part["rows"]) == 2 * voted


def test_a_snapshot_keeps_its_filters_and_judges_and_finds_its_votes_again() -> None:
    study = vote_all(a_study(votes_per_expert=3))
    snapshot = rate(study=study, rounds=10, filters=Filters(types=(ScenarioType.NUDGE.value,)))
    assert snapshot.filters["types"] == [ScenarioType.NUDGE.value]
    person = matchups_of(study, "eva")[0].expert.person
    assert snapshot.results.judges[str(person.code)] == person.pseudonym
    person.pseudonym = "Somebody else"
    person.save()
    assert len(read_votes(snapshot).counted) == 6, "the name of then counts"
    with rewriting(Vote):
        Vote.objects.filter(pk=snapshot.last_vote or 0).update(ms_visible=1)
    with pytest.raises(Conflict, match="not those of this rating any more"):
        read_votes(snapshot)


def test_rows_have_the_columns_of_other_packages_and_no_formulas() -> None:
    study = a_study(votes_per_expert=4)
    first, second, third, _ = matchups_of(study, "eva")
    vote(first, "left", ms_visible=1200)
    vote(second, "right")
    study.allow_both_miss = True
    study.save()
    vote(third, "equal", both_miss=True)
    found = vote_set(study, filters=Filters(), last=last_vote_id(study))
    names = {found.counted[0].judge: "=cmd|calc"}
    lines = list(csv.DictReader(io.StringIO(votes_csv(vote_rows(found.counted, names)).decode())))
    assert tuple(lines[0]) == COLUMNS
    told = [(line["winner"], line["side"], line["ms_visible"]) for line in lines]
    wanted = [("model_a", "left", "1200"), ("model_b", "right", "")]
    assert told == [*wanted, ("tie (bothbad)", "", "")]
    assert lines[0]["model_a"] == first.left.contestant.slug
    assert {line["judge"] for line in lines} == {"'=cmd|calc"}


def test_a_vote_is_exported_with_all_that_was_kept_of_it() -> None:
    study = a_study(votes_per_expert=4)
    first, second, *_ = matchups_of(study, "eva")
    Study.objects.update(ask_strength=True)
    said = {"comment": "=both\nturn", "aids": ("zoom", "ruler"), "strength": "slightly"}
    kept = vote(first, "left", **said)
    vote(second, "skip", reason="unclear", comment="never in the file")
    table = vote_table(rate(study=close_study(study=study), rounds=10))
    (line,) = csv.DictReader(io.StringIO(VOTE_FORMATS["csv"].write(table).decode()))
    milliseconds = kept.at.microsecond // 1000 * 1000
    assert datetime.fromisoformat(line["at"]) == kept.at.replace(microsecond=milliseconds)
    wanted = {
        "position": str(first.position), "aids": "zoom ruler", "strength": "slightly",
        "augmentation_a": str(first.left.code), "augmentation_b": str(first.right.code),
        "comment": "'=both turn",  # no formula, one line
    }  # fmt: skip
    assert {name: line[name] for name in wanted} == wanted
    (row,) = parquet.read_table(io.BytesIO(VOTE_FORMATS["parquet"].write(table))).to_pylist()
    assert (row["position"], row["comment"]) == (first.position, "=both\nturn")
    assert row["augmentation_b"] == wanted["augmentation_b"]


def test_a_snapshot_of_before_keeps_its_file_and_the_hash_of_it() -> None:
    study = a_study(votes_per_expert=4)
    vote(matchups_of(study, "eva")[0], "left")
    snapshot = rate(study=close_study(study=study), rounds=10)
    content = VOTE_FORMATS["csv"].write(vote_table(snapshot))
    assert sha256_hex(content) == snapshot.votes_sha256
    old = [",".join(line.split(",")[:10]) for line in content.decode().splitlines()]
    before = "".join(f"{line}\n" for line in old).encode()
    snapshot.votes_sha256 = sha256_hex(before)
    snapshot.versions = {"results": 1}
    assert VOTE_FORMATS["csv"].write(vote_table(snapshot)) == before
    table = parquet.read_table(io.BytesIO(VOTE_FORMATS["parquet"].write(vote_table(snapshot))))
    assert tuple(table.column_names) == COLUMNS[:10]


AUTHOR, OWN = "eva", "ann"


def table_of(snapshot: Snapshot) -> dict[str, tuple[Any, ...]]:
    return {row.slug: (row.rank, row.rating, row.votes) for row in snapshot.standings.all()}


@pytest.mark.usefixtures("no_charts")
def test_they_count_unless_a_rating_leaves_them_out_and_no_file_says_whose() -> None:
    study = voted(a_study(votes_per_expert=18))
    plain = rate(study=study, rounds=50)
    author = User.objects.get(username=AUTHOR)
    mark_author(study=study, expert=author, contestant=OWN)
    counted = rate(study=study, rounds=50)
    assert "authors" not in str(Event.objects.filter(verb="rate").latest("pk").after)
    assert (counted.votes_sha256, table_of(counted)) == (plain.votes_sha256, table_of(plain))
    left = rate(study=study, rounds=50, filters=Filters(leave_out_own=True))
    own, code = left.votes_left_out["own"], str(author.person.code)
    assert own > 0
    assert left.votes_counted == counted.votes_counted - own
    assert left.votes_sha256 != counted.votes_sha256
    theirs = [vote for vote in read_votes(left).counted if vote.judge == code]
    assert theirs
    assert not any(OWN in (vote.left, vote.right) for vote in theirs)
    files = bundle_files(Snapshot.objects.get(pk=left.pk))
    manifest = json.loads(files["manifest.json"])
    assert (manifest["filters"]["leave_out_own"], manifest["filters"]["authors"]) == (True, 1)
    assert manifest["votes"]["left_out"] == left.votes_left_out
    assert code.encode() not in b"".join(files.values())


# --- As a data set of preferences, read by pandas and by a plain reader of JSON ---------------


def test_votes_are_rows_with_what_was_shown() -> None:
    study = a_study(votes_per_expert=4)
    with pytest.raises(CommandError, match="still open"):
        call_command("export", "preferences", study.name, "--out", "-")
    first, second, third, fourth = matchups_of(study, "eva")
    given = [vote(first, "left"), vote(second, "equal"), vote(third, "right")]
    vote(fourth, "skip", reason="unclear")
    close_study(study=study)
    study.refresh_from_db()
    out = io.StringIO()
    call_command(
        "export", "preferences", study.name, "--out", "-", stdout=out, stderr=io.StringIO()
    )
    lines = [json.loads(line) for line in out.getvalue().splitlines()]
    assert [line["outcome"] for line in lines] == ["left", "equal", "right"]
    line = lines[0]
    assert json.loads(line["modification_a"]) == given[0].shown_left.modification
    assert json.loads(line["scene"]) == first.scenario.base_scene.document
    assert line["instruction"] == first.scenario.instruction
    assert line["judge"] == first.expert.person.pseudonym
    assert "eva" not in out.getvalue()
    sheet = preference_sheet(study)
    table = pd.read_parquet(io.BytesIO(PREFERENCE_FORMATS["parquet"].write(sheet)))
    assert table.astype(object).where(table.notna(), None).to_dict("records") == lines
    pairs = preference_sheet(study, pairs=True)
    content = PREFERENCE_FORMATS["jsonl"].write(pairs)
    read = pd.read_json(io.BytesIO(content), lines=True, dtype=False)
    chosen = [given[0].shown_left, given[2].shown_right]
    assert read["augmentation_chosen"].tolist() == [str(row.code) for row in chosen]
    assert [json.loads(text) for text in read["chosen"]] == [row.modification for row in chosen]
    assert read["contradicted"].tolist() == [False, False]


def test_votes_of_one_expert_for_both_sides_are_marked() -> None:
    study = a_study(votes_per_expert=3)
    first, *others = matchups_of(study, "eva")
    for matchup in (first, *others, shown_again(first)):  # the repeat shows the sides turned
        vote(matchup, "left")
    close_study(study=study)
    study.refresh_from_db()
    sheet = preference_sheet(study, pairs=True)
    rows = [dict(zip(sheet.columns, row, strict=True)) for row in sheet.rows]
    assert [(row["contradicted"], row["repeat"]) for row in rows] == [
        (True, False),
        *[(False, False)] * 2,
        (True, True),
    ]
