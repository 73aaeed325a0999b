"""The tabs of the results page: each makes what its template needs of a snapshot and its table."""

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from django.db.models import Q
from django.db.models.fields.json import KT

from arena.jobs.exports.driving import driving_context
from arena.jobs.queries import list_shown_ids
from arena.models import Question, Snapshot
from arena.people.queries import natural_order
from arena.rating.agreement import agreement_sentence
from arena.rating.comparisons import Estimate
from arena.rating.panel import Reliability, judge_rater
from arena.rating.snapshot_document import BoardRemarks, PairRecord, PanelRater
from arena.results.exports import tables
from arena.results.exports.agreement import agreement_by_question
from arena.results.exports.charts import key_rows, make_scatters
from arena.results.pages.plots import PlacedInterval, plot
from arena.results.queries.access import list_events, list_snapshots, names_in_log
from arena.results.queries.evidence import count_settled
from arena.results.queries.votes import AUTOMATIC, Filters
from arena.results.services.analysis import FEW_VOTES
from arena.results.services.questions import compare_questions
from augment.models import EndpointModel, NuplanResult, Simulation
from augment.services.driving import find_shown, scores_of_augmentations
from augment.services.driving.simulations import SCORES

Context = dict[str, Any]

LOG_LINES = 200


def describe(snapshot: Snapshot, *, is_staff: bool) -> Context:
    """Return the common part of all tabs of a rating: its table, and its meaning in a sentence."""
    table = tables.leaderboard_table(snapshot)
    if not is_staff:
        table = tables.for_experts(table)
    settled = count_settled(snapshot)
    cast = snapshot.votes_counted - settled
    return {
        "table": table,
        "answer": snapshot.results.board.answer(table.rows, [r.slug for r in table.rows], cast),
        "early_look": tables.EARLY_LOOK,
        "settled": settled,
        "cast": cast,
    }


def fill_table(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """The table with its intervals, and the lines that say how far it can be trusted."""
    trust = snapshot.results.trust
    moves = [line.moves for line in trust.raters if line.moves is not None]
    names = {row.slug: row.name for row in table.rows}
    order = trust.strength.order if trust.strength else ()
    both_miss = sum(pair.both_miss for pair in snapshot.results.pairs)
    settled = count_settled(snapshot)
    cast = max(snapshot.votes_counted - settled, 1)
    ties = sum(pair.ties for pair in snapshot.results.pairs)
    return plot(table.rows) | {
        "largest_move": max(moves, default=None),
        "ties": ties,
        "tie_share": (ties - settled) / cast,
        "all_tied": ties == snapshot.votes_counted,
        "both_miss": both_miss,
        "both_miss_share": both_miss / cast,
        "weighed_order": [names[slug] for slug in order],
        "fragile_first": names.get(trust.fragility.first) if trust.fragility else None,
    }


def fill_all(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """The same, with the study's questions beside each other where it asks several."""
    return fill_table(snapshot, table) | {"questions": compare_questions(snapshot)}


def fill_pairs(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """Every pair as a line, from the view of the one that stands higher."""
    board = snapshot.results.board
    place = {row.slug: n for n, row in enumerate(table.rows)}
    apart = None if board.above is None else {frozenset(pair) for pair in board.above}
    p_values = {frozenset((value.a, value.b)): value.p for value in board.p_values or ()}

    def line_of(pair: PairRecord) -> Context:
        higher, lower = sorted((pair.a, pair.b), key=place.__getitem__)
        counts = {"wins": pair.wins, "losses": pair.losses}
        if higher != pair.a:
            counts = {"wins": pair.losses, "losses": pair.wins}
        both = frozenset((higher, lower))
        return counts | {
            "a": table.rows[place[higher]],
            "b": table.rows[place[lower]],
            "kept": pair,
            "p": p_values.get(both),
            "apart": None if apart is None else both in apart,
        }

    lines = [line_of(pair) for pair in snapshot.results.pairs]
    lines.sort(key=lambda line: (place[line["a"].slug], place[line["b"].slug]))
    return {
        "lines": lines,
        "has_plan": any(pair.planned is not None for pair in snapshot.results.pairs),
        "has_p_values": bool(p_values),
        "told_apart": None if apart is None else len(apart),
    }


def fill_types(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """One chart of all scenario types, and a table each."""
    whole = {row.slug: row for row in table.rows}
    names = ("rank", "rating", "lower", "upper", "votes")
    parts: list[Context] = []
    for part in snapshot.results.types:
        rows = [
            replace(
                whole[line.slug],
                rank_best=None,
                rank_worst=None,
                note=line.note or "",
                settled_ties=line.settled or 0,
                **{name: getattr(line, name) for name in names},
            )
            for line in part.lines
            if line.votes
        ]
        if not snapshot.results.board.order:  # of an earlier version
            rows.sort(key=lambda row: (row.rating is None, -(row.rating or 0.0), row.slug))
        reasons = (part.status,) if part.reasons is None else part.reasons
        parts.append({"kept": part, "rows": rows, "reasons": reasons})
    return {
        "parts": parts,
        "few_votes": FEW_VOTES,
        "any_few": any(row.votes_cast < FEW_VOTES for part in parts for row in part["rows"]),
        "thin": [
            (part["kept"].label, part["kept"].votes - (part["kept"].settled or 0))
            for part in parts
            if all(row.votes_cast < FEW_VOTES for row in part["rows"])
        ],
    }


def fill_raters(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """A judgement of each expert, who needs a look first; agreement, repeats, sides, figures."""
    trust = snapshot.results.trust
    lines = [line for line in trust.raters if line.judge != AUTOMATIC]
    authors = {judge for judge, _ in Filters.of_document(snapshot.filters).authors}
    panel = [
        {
            "rater": line,
            "is_author": line.judge in authors,
            "judgement": judge_rater(line),
            **_counts(line),
        }
        for line in sorted(lines, key=lambda line: natural_order(line.name))
    ]
    urgency = list(Reliability)
    panel.sort(key=lambda line: urgency.index(line["judgement"].reliability))
    numbers = Counter(line["judgement"].reliability for line in panel)
    return {
        "trust": trust,
        "all_tied": trust.tie_share == 1.0,
        "panel": panel,
        "numbers": [(word, numbers[word]) for word in urgency if numbers[word]],
        "has_times": any(line.median_ms is not None for line in lines),
        "has_repeats": any(line.repeats[0] for line in lines),
        "has_checks": any(line.checks[0] or line.checks_skipped for line in lines),
        "automatic": sum(line.votes for line in trust.raters if line.judge == AUTOMATIC),
        "automatic_judge": AUTOMATIC,
    }


def _counts(rater: PanelRater) -> Context:
    """Return the vote counts behind an expert's shares; of favourites only if all have them."""
    ties, left = round(rater.ties * rater.votes), rater.left.value
    decided = rater.votes - ties
    return {
        "ties": ties,
        "left": None if left is None else round(left * decided),
        "all_foreseen": rater.decided == decided,
    }


def fill_agreement(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """Return the agreement of metrics: each question's decided votes, and by scenario type."""
    labels = {part.type: part.label for part in snapshot.results.types}
    return {
        "questions": [
            {
                "label": Question(question).label,
                "sentence": agreement_sentence(lines),
                "lines": [(line, _mark(line.share)) for line in lines if not line.type],
                "by_type": [
                    (label, [line for line in lines if line.type == name])
                    for name, label in labels.items()
                    if lines[-1].type
                ],
            }
            for question, lines in agreement_by_question(snapshot).items()
        ],
        "ticks": [(f"{number} %", number) for number in (0, 50, 100)],
    }


_DISTANCES = {"wish": "distance to the wish", "displacement": "displacement"}


def fill_displacement(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """Elo against the distances to the wishes and from the references."""
    lines = _key_rows(table, {line.slug: line for line in snapshot.results.displacement})
    drawn = make_scatters(snapshot, table)
    return {
        "lines": lines,
        "charts": [
            (name, f"Elo against {words}") for name, words in _DISTANCES.items() if name in drawn
        ],
        "wishes": any(line.wish_median_m is not None for line in snapshot.results.displacement),
        "moves": any(line.at_t0_m is not None for line in snapshot.results.displacement),
    }


def fill_driving(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """The drives of the augmentations that the study shows."""
    ids = list_shown_ids(snapshot.study)
    if not (Simulation.objects.exists() or NuplanResult.objects.exists()):
        return {"drivings": []}
    how = find_shown(Q(augmentation__in=ids))
    scores = [
        scores_of_augmentations(ids, title=snapshot.study.name, options=how, score=score)
        for score in SCORES
    ]
    return {"drivings": [driving_context(score) for score in scores if score.lines]}


def fill_cost(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """Elo against money, by class of model."""
    metres = {line.slug: line.median_m for line in snapshot.results.displacement}
    labels = {value: str(label) for value, label in EndpointModel.ModelClass.choices}
    lines = _key_rows(table, {line.slug: line for line in snapshot.results.cost})
    return {
        "lines": [
            line
            | {
                "class_label": labels.get(line["found"].model_class, ""),
                "median_m": metres.get(line["row"].slug),
            }
            for line in lines
        ],
        "has_chart": "elo-usd" in make_scatters(snapshot, table),
    }


def fill_log(snapshot: Snapshot, table: tables.LeaderboardTable) -> Context:
    """Return the events of the study, and every rating of it."""
    study = snapshot.study
    rows = list_snapshots(study).defer("results").annotate(settled=KT("results__board__settled"))
    ratings = list(rows.select_related("made_by__person"))
    for row in ratings:  # of their results that alone, not a document for each
        row.settled_ties = BoardRemarks(settled=json.loads(row.settled or "null")).settled_ties
    return {
        "events": list_events(study, most=LOG_LINES),
        "names": {row.slug: row.model for row in table.rows} | names_in_log(study),
        "most": LOG_LINES,
        "ratings": ratings,
    }


TABS: dict[str, Callable[[Snapshot, tables.LeaderboardTable], Context]] = {
    "table": fill_all,
    "pairs": fill_pairs,
    "types": fill_types,
    "raters": fill_raters,
    "agreement": fill_agreement,
    "displacement": fill_displacement,
    "driving": fill_driving,
    "cost": fill_cost,
    "log": fill_log,
}
MAIN = ("table", "pairs")
"""The tabs in the first line; the others are further measures."""

FOR_EXPERTS = ("table", "pairs", "types")
"""The tabs that not only researchers and admins see."""


# --- Private -----------------------------------------------------------------------------------


def _mark(share: Estimate) -> PlacedInterval | None:
    """A share in percent on an axis to 100; without an interval a point."""
    if share.value is None:
        return None
    bounds = {"lower": share.lower, "rating": share.value, "upper": share.upper}
    return {
        name: round(100.0 * (share.value if bound is None else bound), 2)
        for name, bound in bounds.items()
    }


def _key_rows(table: tables.LeaderboardTable, values: Mapping[str, Any]) -> list[Context]:
    """Return each contestant's results, with its key in the charts."""
    return [
        {"key": key, "row": row, "found": values[row.slug]}
        for key, row in key_rows(table)
        if row.slug in values
    ]
