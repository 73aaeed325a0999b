"""Votes as a data set of preferences, read by pandas and by a plain reader of JSON."""

import io
import json

import pandas as pd
import pytest
from django.core.management import CommandError, call_command

from arena.results.exports.preferences import PREFERENCE_FORMATS, preference_sheet
from arena.studies.services.opening import close_study
from tests.study_rows import a_study, matchups_of, shown_again, vote

pytestmark = pytest.mark.django_db


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
