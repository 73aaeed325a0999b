"""The votes of a closed study as a data set of preferences: a row a vote, flat and typed.

Documents are JSON texts in our own format, so that JSON lines and Parquet have the same columns
and `datasets` loads both without a script. People are pseudonyms.
"""

import json
from collections.abc import Iterator
from typing import Any

from arena.errors import StudyStillOpen
from arena.exports.files import sha256_hex
from arena.exports.formats import Dtype, Sheet, formats, sheet_jsonl, sheet_parquet
from arena.jobs.queries import list_shown_ids
from arena.models import Question, Study, Vote
from arena.pairing.order import REPEAT
from arena.results.queries.votes import AUTOMATIC, KINDS, Filters, last_vote_id, vote_set
from arena.results.services.vote_files import vote_rows, votes_csv
from arena.voting.queries.blinding import is_imported
from augment.errors import Conflict
from augment.models import Augmentation
from augment.services.judging import scene_source

PREFERENCE_FORMATS = formats(jsonl=sheet_jsonl, parquet=sheet_parquet)

_TEXT, _WHOLE, _YES_NO = Dtype.TEXT, Dtype.WHOLE, Dtype.YES_NO
_WHERE = {
    **dict.fromkeys(("study", "votes_sha256", "question", "question_text"), _TEXT),
    **dict.fromkeys(("scenario", "type", "instruction", "intent", "scene", "source"), _TEXT),
    "non_commercial": _YES_NO,
}
_GIVEN = {
    **dict.fromkeys(("strength", "judge", "at"), _TEXT),
    **dict.fromkeys(("position", "ms_visible"), _WHOLE),
    "aids": _TEXT,
    **dict.fromkeys(("repeat", "settled", "simulated", "contradicted"), _YES_NO),
}
_SIDE = ("contestant", "augmentation", "modification")
VOTES = {
    **_WHERE,
    **{f"{name}_{side}": _TEXT for side in "ab" for name in _SIDE},
    **{"outcome": _TEXT, "both_miss": _YES_NO},
    **_GIVEN,
}
"""`a` was on the left; `outcome` is left, equal or right."""
PAIRS = {
    **dict.fromkeys(("prompt", "chosen", "rejected"), _TEXT),
    **_WHERE,
    **{f"{name}_{side}": _TEXT for side in ("chosen", "rejected") for name in _SIDE[:2]},
    **_GIVEN,
}
"""Votes with a preference alone, as trainers take them."""

_SIDES = {Vote.Outcome.LEFT.value: ("a", "b"), Vote.Outcome.RIGHT.value: ("b", "a")}


def preference_sheet(study: Study, *, pairs: bool = False) -> Sheet:
    """Return a row a vote that counts, hidden repeats and settled pairs too.

    Args:
        study: A closed one of our own.
        pairs: Whether only preferences, as chosen and rejected.

    Raises:
        StudyStillOpen, Conflict: It takes votes, or its votes are of a file without scenes.
    """
    if study.state == Study.State.OPEN:
        raise StudyStillOpen(study.name)
    if is_imported(study):
        raise Conflict(f"The votes of '{study.name}' are of a file, which has no scenes.")
    rows = [row for question in study.questions for row in _list_rows(study, question)]
    sides: dict[tuple[str, ...], set[str]] = {}
    for row in rows:
        sides.setdefault(_unit(row), set()).add(_winner(row))
    for row in rows:
        # Of one expert, question and pair of pictures: votes for both sides.
        row["contradicted"] = len(sides[_unit(row)] - {""}) > 1 and not row["settled"]
    if pairs:
        rows = [_pair(row) for row in rows if row["outcome"] in _SIDES]
    columns = PAIRS if pairs else VOTES
    values = [tuple(row[name] for name in columns) for row in rows]
    return Sheet(name="preferences", columns=columns, rows=values)


# --- Private -----------------------------------------------------------------------------------


def _list_rows(study: Study, question: str) -> Iterator[dict[str, Any]]:
    filters = Filters(kinds=KINDS, question=question)
    votes = vote_set(study, filters=filters, last=last_vote_id(study)).counted
    names = {vote.judge: vote.judge_name for vote in votes}
    common = {
        "study": study.name,
        "votes_sha256": sha256_hex(votes_csv(vote_rows(votes, names))),
        "question": question,
        "question_text": str(Question(question).label),
    }
    shown = Augmentation.objects.filter(pk__in=list_shown_ids(study)).select_related("contestant")
    # By code what was shown, and by contestant for ties on pairs that nobody was.
    made = {str(row.code): row for row in shown}
    each = study.shows_all_samples
    made |= {f"{row.scenario_id} {row.sample * each} {row.contestant.slug}": row for row in shown}
    texts = {key: _json(row.modification) for key, row in made.items()}
    places: dict[str, tuple[int, dict[str, Any]]] = {}
    for row in study.scenarios.select_related("base_scene"):
        source = scene_source(row.base_scene)
        places[row.slug] = (
            row.pk,
            {
                **{"scenario": row.slug, "type": row.type, "instruction": row.wording},
                **{"intent": _json(row.intent), "scene": _json(row.base_scene.document)},
                **{"source": source.provenance, "non_commercial": source.is_non_commercial},
            },
        )
    for vote in votes:
        scenario, where = places[vote.item]
        is_settled = vote.kind == AUTOMATIC
        line = {**common, **where, "judge": None if is_settled else vote.judge_name}
        for side, slug, code in (
            ("a", vote.left, vote.left_code),
            ("b", vote.right, vote.right_code),
        ):
            key = code or f"{scenario} {vote.sample} {slug}"
            line[f"contestant_{side}"] = slug
            line[f"augmentation_{side}"] = str(made[key].code) if key in made else None
            line[f"modification_{side}"] = texts.get(key)
        names_kept = ("outcome", "both_miss", "strength", "position", "ms_visible", "aids", "at")
        line |= {name: getattr(vote, name) for name in names_kept}
        line |= {"simulated": vote.is_simulated, "settled": is_settled}
        yield {**line, "repeat": vote.kind == REPEAT}


def _unit(row: dict[str, Any]) -> tuple[str, ...]:
    shown = sorted(str(row[f"augmentation_{side}"]) for side in "ab")
    return str(row["judge"]), row["question"], row["scenario"], *shown


def _winner(row: dict[str, Any]) -> str:
    side = _SIDES.get(row["outcome"], ("",))[0]
    return str(row[f"augmentation_{side}"]) if side else ""


def _pair(row: dict[str, Any]) -> dict[str, Any]:
    by_name = dict(zip(("chosen", "rejected"), _SIDES[row["outcome"]], strict=True))
    pair = {
        f"{name}_{word}": row[f"{name}_{side}"] for word, side in by_name.items() for name in _SIDE
    }
    texts = {word: row[f"modification_{side}"] for word, side in by_name.items()}
    return {**row, **pair, **texts, "prompt": row["instruction"]}


def _json(document: object) -> str | None:
    return None if document is None else json.dumps(document, sort_keys=True)
