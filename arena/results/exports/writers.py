"""A rating as files: its table in every format, and all of it in one zip.

The same snapshot always gives the same bytes.
"""

import json
from collections.abc import Iterable, Sequence
from typing import Any

from arena.exports.cells import csv_text
from arena.exports.files import zip_bytes
from arena.exports.formats import Format, drawings, formats, parquet_bytes, round_value
from arena.models import Snapshot
from arena.rating.lines import caption_text, escape, latex_table
from arena.rating.snapshot_document import Results, results_document
from arena.results.exports.charts import CONTENT_TYPES as CHART_FORMATS
from arena.results.exports.charts import charts, interval_chart
from arena.results.exports.tables import (
    IN_FILES,
    IN_JSON,
    PRINTED,
    LeaderboardTable,
    Row,
    leaderboard_table,
)
from arena.results.exports.votes import VOTE_FORMATS, vote_table
from arena.results.services.vote_files import digest_of
from arena.studies.services.opening import FILE_NAME
from arena.studies.services.plan import Answered

MANIFEST = "manifest.json"


# --- The table ---------------------------------------------------------------------------------


def csv_bytes(table: LeaderboardTable) -> bytes:
    """One line a contestant; what is unknown is empty, numbers have two decimals."""
    return csv_text([column.name for column in IN_FILES], _values(table)).encode()


def parquet_of(table: LeaderboardTable) -> bytes:
    """The columns of the CSV file, typed; numbers as they are."""
    return parquet_bytes({column.name: column.kind for column in IN_FILES}, _values(table))


def json_bytes(table: LeaderboardTable) -> bytes:
    """An object whose `standings` is a list of {model, rank, rating, lower, upper, votes, ...}."""
    notes = {name: note for name, note in table.notes_on_method.items() if name == "intervals"}
    document: dict[str, Any] = {
        "format": "scenario-arena/leaderboard",
        "version": 1,
        "study": table.study,
        "simulated": table.simulated,
        "early": table.early,
        "method": {
            "name": table.method,
            "text": table.method_text,
            "resampling_unit": table.unit,
            **notes,
            "rounds": table.rounds,
            "degenerate_rounds": table.degenerate_rounds,
            "seed": table.seed,
        },
        "votes": {
            "counted": table.votes,
            "left_out": table.left_out,
            "sha256": table.votes_sha256,
        },
        "preregistration": table.preregistration or None,
        "hypotheses": [_hypothesis(answer) for answer in table.hypotheses],
        "status": table.status,
        "standings": [_standing(table, row) for row in table.rows],
    }
    return (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode()


def plain_text(table: LeaderboardTable) -> str:
    """The table for a terminal, with its method and warnings beneath."""
    grid = [
        [column.printed for column in PRINTED],
        *([column.text(row) for column in PRINTED] for row in table.rows),
    ]
    widths = [max(map(len, column)) for column in zip(*grid, strict=True)]
    lines = [
        "  ".join(
            cell.rjust(width) if place else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in grid
    ]
    left_out = ", ".join(f"{number} {reason}" for reason, number in table.left_out.items())
    lines += ["", *(f"{line}." for line in table.missing)]
    lines.append(f"{table.votes} votes counted; left out: {left_out or 'none'}.")
    lines.append(f"{table.method_text}.")
    if table.frozen_text:
        lines.append(f"{table.frozen_text[0].upper()}{table.frozen_text[1:]}.")
    lines += [_hypothesis_line(answer) for answer in table.hypotheses]
    return "\n".join([*lines, *table.warnings])


def latex(table: LeaderboardTable) -> str:
    """The paper's table with comments: needs booktabs and xcolor with the option `table`."""
    marks = [word for word, so in (("simulated", table.simulated), ("early", table.early)) if so]
    caption = caption_text(
        table.method_text, votes=table.votes, experts=table.experts, scenarios=table.scenarios
    )
    return latex_table(
        (
            [_latex_name(row), *(column.text(row) for column in PRINTED if not column.identifies)]
            for row in table.rows
        ),
        heads=[column.printed for column in PRINTED],
        comments=(
            f"{table.study}: {table.votes} votes; {table.method_text}",
            f"votes sha256 {table.votes_sha256}",
            *((table.frozen_text,) if table.frozen_text else ()),
            *table.warnings,
        ),
        notes=table.missing,
        caption=f"{caption} ({', '.join(marks)})" if marks else caption,
    )


FORMATS: dict[str, Format[LeaderboardTable]] = formats(
    csv=csv_bytes,
    json=json_bytes,
    parquet=parquet_of,
    latex=lambda table: latex(table).encode(),
    **drawings(interval_chart),
)


# --- Everything in one zip ---------------------------------------------------------------------


def bundle(snapshot: Snapshot) -> bytes:
    """Everything about a rating in one zip with its manifest.

    Raises:
        Conflict: The votes are not what they were when they were rated.
    """
    return zip_bytes(bundle_files(snapshot))


def bundle_files(snapshot: Snapshot) -> dict[str, bytes]:
    """What is in the zip, by name; raises as `bundle`."""
    table, results = leaderboard_table(snapshot), snapshot.results
    votes = vote_table(snapshot)
    files = {
        f"leaderboard.{chosen.suffix}": chosen.write(table)
        for chosen in FORMATS.values()
        if chosen.suffix not in CHART_FORMATS
    }
    files |= {f"votes.{chosen.suffix}": chosen.write(votes) for chosen in VOTE_FORMATS.values()}
    files |= {
        f"{name}.{form}": chart(file_format=form)
        for name, chart in charts(snapshot).items()
        for form in CHART_FORMATS
    }
    files["pairs.csv"] = _pairs_csv(results)
    files["types.csv"] = _types_csv(results)
    files["raters.csv"] = _raters_csv(results)
    frozen = snapshot.study.preregistration.encode()
    if frozen:
        files[FILE_NAME] = frozen
    if table.hypotheses:
        files["hypotheses.csv"] = _hypotheses_csv(table.hypotheses)
    files["statistics.json"] = _json(_statistics(results))
    files[MANIFEST] = _json(_manifest(snapshot, table, files))
    return files


# --- Private -----------------------------------------------------------------------------------


def _values(table: LeaderboardTable) -> list[list[object]]:
    return [[column.value_of(table, row) for column in IN_FILES] for row in table.rows]


def _standing(table: LeaderboardTable, row: Row) -> dict[str, Any]:
    values = {column.key: column.value_of(table, row) for column in IN_JSON}
    part = {"part": row.part} if table.has_parts else {}
    return {
        key: round_value(value) if isinstance(value, float) else value
        for key, value in values.items()
    } | part


def _latex_name(row: Row) -> str:
    """The model's name, its variant in typewriter letters as in the paper."""
    if not row.variant:
        return escape(row.model)
    before, _, after = row.model.rpartition(row.variant)
    return rf"{escape(before)}\texttt{{{escape(row.variant)}}}{escape(after)}"


def _hypothesis(answer: Answered) -> dict[str, Any]:
    above = answer.hypothesis.above
    return {
        "hypothesis": answer.hypothesis.text,
        "above": list(above) if above else None,
        "verdict": answer.verdict,
        "difference": None if answer.difference is None else round(answer.difference, 2),
        "p_adjusted": answer.p,
    }


def _hypothesis_line(answer: Answered) -> str:
    text = f"Hypothesis: {answer.hypothesis.text}"
    if answer.verdict is None:
        return text
    numbers = [] if answer.difference is None else [f"{answer.difference:+.0f} points"]
    if answer.p is not None:
        numbers.append(f"p {answer.p:.3f} adjusted")
    return f"{text}: {answer.verdict} ({', '.join(numbers) or 'unrated'})."


def _manifest(
    snapshot: Snapshot, table: LeaderboardTable, files: dict[str, bytes]
) -> dict[str, Any]:
    judges = snapshot.results.judges
    filters: dict[str, Any] = dict(snapshot.filters)
    if "experts" in filters:  # by pseudonym, as votes are
        filters["experts"] = sorted(
            judges.get(code, "without votes") for code in filters["experts"]
        )
    if "authors" in filters:
        filters["authors"] = len(filters["authors"])
    return {
        "format": "scenario-arena/rating",
        "version": 1,
        "study": table.study,
        "rating": str(snapshot.code),
        "rated_at": snapshot.made_at.isoformat(),
        "simulated": table.simulated,
        "early": table.early,
        "preregistration": {"file": FILE_NAME, "sha256": table.preregistration}
        if table.preregistration
        else None,
        "warnings": list(table.warnings),
        "method": {
            "name": table.method,
            "text": table.method_text,
            "resampling_unit": table.unit,
            **table.notes_on_method,
            "rounds": table.rounds,
            "seed": table.seed,
        },
        "filters": filters,
        "votes": {
            "counted": table.votes,
            "left_out": table.left_out,
            "sha256": table.votes_sha256,
            "file": "votes.csv",
        },
        "versions": dict(sorted(snapshot.versions.items())),
        "files": {
            name: {"sha256": digest_of(content), "bytes": len(content)}
            for name, content in sorted(files.items())
        },
    }


def _statistics(results: Results) -> dict[str, Any]:
    """The statistics without the codes of people; pseudonyms stay."""
    document = results_document(results)
    trust = document.get("trust", {})
    for line in trust.setdefault("raters", []):
        del line["judge"], line["expert"]
    if trust.get("repeats"):
        del trust["repeats"]["by_expert"]
    return document | {"trust": trust, "judges": sorted(results.judges.values())}


def _json(document: object) -> bytes:
    # Sorted, because PostgreSQL keeps the keys of stored documents in an order of its own.
    text = json.dumps(document, indent=2, ensure_ascii=False, sort_keys=True)
    return (text + "\n").encode()


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    return csv_text(head, rows).encode()


def _pairs_csv(results: Results) -> bytes:
    head = ("a", "b", "wins", "ties", "losses", "both_miss", "planned")
    more: tuple[str, ...] = ()
    if results.board.p_values is not None:
        more = ("difference", "lower", "upper", "p")
    judged = {(value.a, value.b): value for value in results.board.p_values or ()}
    rows = (
        [
            *(getattr(pair, name) for name in head),
            *(getattr(judged.get((pair.a, pair.b)), name, None) for name in more),
        ]
        for pair in results.pairs
    )
    return _csv([*head, *("p_adjusted" if name == "p" else name for name in more)], rows)


def _types_csv(results: Results) -> bytes:
    head = ("type", "contestant", "rank", "elo", "lower", "upper", "votes", "too_few", "note")
    keys = ("slug", "rank", "rating", "lower", "upper", "votes", "few", "note")
    lines = [(part.type, line) for part in results.types for line in part.lines]
    return _csv(head, ([name, *(getattr(line, key) for key in keys)] for name, line in lines))


def _raters_csv(results: Results) -> bytes:
    head = (
        "judge",
        "votes",
        "median_ms",
        "under_1_s",
        "ties",
        "left",
        "agreement",
        "shared",
        "favourites",
        "decided",
        "repeats",
        "repeats_same",
        "checks",
        "checks_passed",
        "moves",
        "checks_skipped",
        "aids",
    )
    rows = (
        [
            line.name,
            line.votes,
            line.median_ms,
            line.fast,
            line.ties,
            line.left.value,
            line.agreement.value,
            line.shared,
            line.favourites.value,
            line.decided,
            *line.repeats,
            *line.checks,
            line.moves,
            line.checks_skipped,
            " ".join(f"{name}={number}" for name, number in line.aids),
        ]
        for line in results.trust.raters
    )
    return _csv(head, rows)


def _hypotheses_csv(answers: Sequence[Answered]) -> bytes:
    head = ("hypothesis", "better", "other", "verdict", "difference", "p_adjusted")
    rows = (
        [
            answer.hypothesis.text,
            *(answer.hypothesis.above or ("", "")),
            answer.verdict or "",
            answer.difference,
            answer.p,
        ]
        for answer in answers
    )
    return _csv(head, rows)
