"""Everything about a rating in one zip; the same rating always gives the same bytes."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any

from arena.exports.charts.rating import CONTENT_TYPES as CHART_FORMATS
from arena.exports.charts.rating import charts
from arena.exports.hypotheses import COLUMNS as HYPOTHESIS_COLUMNS
from arena.exports.hypotheses import hypothesis_row
from arena.exports.tables import leaderboard_table
from arena.exports.votes import VOTE_FORMATS, vote_table
from arena.exports.writers import FORMATS
from arena.exports.zips import zip_bytes
from arena.models import Snapshot
from arena.rating.snapshot_document import Results, results_document
from arena.services.cells import csv_text
from arena.services.vote_rows import digest_of
from arena.studies.services.opening import FILE_NAME, preregistration_bytes

MANIFEST = "manifest.json"


def bundle(snapshot: Snapshot) -> bytes:
    """The zip with its manifest.

    Raises:
        Conflict: The votes are not what they were when they were rated.
    """
    return zip_bytes(bundle_files(snapshot))


def bundle_files(snapshot: Snapshot) -> dict[str, bytes]:
    """What is in the zip, by name.

    Raises:
        Conflict: The votes are not what they were when they were rated.
    """
    files = _files(snapshot)
    files[MANIFEST] = _manifest(snapshot, files)
    return files


# --- Private -----------------------------------------------------------------------------------


def _files(snapshot: Snapshot) -> dict[str, bytes]:
    table = leaderboard_table(snapshot)
    results = snapshot.results
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
    files["pairs.csv"] = _pairs(results)
    files["types.csv"] = _types(results)
    files["raters.csv"] = _raters(results)
    frozen = preregistration_bytes(snapshot.study)
    if frozen:
        files[FILE_NAME] = frozen
    if table.hypotheses:
        files["hypotheses.csv"] = _csv(HYPOTHESIS_COLUMNS, map(hypothesis_row, table.hypotheses))
    files["statistics.json"] = _json(_public(results))
    return files


def _manifest(snapshot: Snapshot, files: dict[str, bytes]) -> bytes:
    table = leaderboard_table(snapshot)
    return _json(
        {
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
                **table.intervals_note,
                **table.adjusted_note,
                "rounds": table.rounds,
                "seed": table.seed,
            },
            "filters": _filters(snapshot),
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
    )


def _filters(snapshot: Snapshot) -> dict[str, Any]:
    """Which votes were asked for: experts by pseudonym, as votes are, of authors only the number.

    An expert who was asked for without having a vote that counts has no name here.
    """
    judges = snapshot.results.judges
    filters: dict[str, Any] = dict(snapshot.filters)
    if "experts" in filters:
        filters["experts"] = sorted(
            judges.get(code, "without votes") for code in filters["experts"]
        )
    if "authors" in filters:
        filters["authors"] = len(filters["authors"])
    return filters


def _public(results: Results) -> dict[str, Any]:
    """The statistics without the codes of people; pseudonyms stay."""
    document = results_document(results)
    trust = document.get("trust", {})
    for line in trust.setdefault("raters", []):
        del line["judge"], line["expert"]
    for holder, codes in (
        (trust.get("repeats"), "by_expert"),
        (document.get("own_votes"), "by_judge"),
    ):
        if holder:
            del holder[codes]
    return document | {"trust": trust, "judges": sorted(results.judges.values())}


def _json(document: object) -> bytes:
    # Sorted, because PostgreSQL keeps the keys of stored documents in an order of its own.
    text = json.dumps(document, indent=2, ensure_ascii=False, sort_keys=True)
    return (text + "\n").encode()


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    return csv_text(head, rows).encode()


def _pairs(results: Results) -> bytes:
    head = ("a", "b", "wins", "ties", "losses", "both_miss", "planned")
    rows = ([getattr(pair, name) for name in head] for pair in results.pairs)
    if results.board.p_values is None:
        return _csv(head, rows)
    adjusted = {(one.a, one.b): one for one in results.board.p_values}
    more = ("difference", "lower", "upper", "p")
    judged = (
        [getattr(adjusted.get((pair.a, pair.b)), name, None) for name in more]
        for pair in results.pairs
    )
    heads = (*head, *more[:-1], "p_adjusted")
    return _csv(heads, ([*row, *own] for row, own in zip(rows, judged, strict=True)))


def _types(results: Results) -> bytes:
    head = ("type", "contestant", "rank", "elo", "lower", "upper", "votes", "too_few", "note")
    keys = ("slug", "rank", "rating", "lower", "upper", "votes", "few", "note")
    lines = [(part.type, line) for part in results.types for line in part.lines]
    return _csv(head, ([name, *(getattr(line, key) for key in keys)] for name, line in lines))


def _raters(results: Results) -> bytes:
    head = (
        "judge", "votes", "median_ms", "under_1_s", "ties", "left", "agreement", "shared",
        "favourites", "decided", "repeats", "repeats_same", "checks", "checks_passed", "moves",
        "checks_skipped", "aids",
    )  # fmt: skip
    return _csv(
        head,
        (
            [
                line.name, line.votes, line.median_ms, line.fast, line.ties, line.left.value,
                line.agreement.value, line.shared, line.favourites.value, line.decided,
                *line.repeats, *line.checks, line.moves, line.checks_skipped,
                " ".join(f"{name}={number}" for name, number in line.aids),
            ]
            for line in results.trust.raters
        ),
    )  # fmt: skip
