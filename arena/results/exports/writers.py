"""A rating as files: its table in every format, and all of it in one zip.

The same snapshot always gives the same bytes.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import Any

from django.http import Http404, HttpResponse
from django.utils.text import slugify

from arena.exports import formats
from arena.exports.cells import csv_text
from arena.exports.files import describe_files, zip_bytes
from arena.exports.latex import PLACES_LEFT, align_cells, caption_text, escape, latex_table
from arena.exports.leaderboard import RATING, file_columns, list_columns, print_lines
from arena.models import Snapshot
from arena.rating.rules import Intervals
from arena.rating.snapshot_document import Results, results_document
from arena.results.exports.agreement import FORMATS as AGREEMENT_FORMATS
from arena.results.exports.agreement import agreement_rating
from arena.results.exports.charts import Chart, charts, interval_chart
from arena.results.exports.tables import LeaderboardTable, Row, leaderboard_table
from arena.results.exports.votes import VOTE_FORMATS, vote_table
from arena.studies.services.opening import FILE_NAME
from arena.studies.services.plan import HypothesisAnswer
from augment.errors import UnknownName, check_names

MANIFEST = "manifest.json"


# --- The table ---------------------------------------------------------------------------------


def leaderboard_sheet(table: LeaderboardTable) -> formats.Sheet:
    """Return one row a contestant; in CSV numbers have two decimals."""
    columns = file_columns(RATING, table, is_old=_is_old(table))
    return formats.make_sheet(table.rows, columns, name="leaderboard", digits=None, number=".2f")


def leaderboard_json(table: LeaderboardTable) -> bytes:
    """Return an object whose `standings` is a list of {model, rank, rating, lower, upper, ...}."""
    return formats.json_bytes(
        _document(table) | {"standings": [_standing(table, row) for row in table.rows]}
    )


def _document(table: LeaderboardTable) -> dict[str, Any]:
    """Return the part of a JSON file beside the lines of a rating."""
    rating, settled = table.snapshot, table.snapshot.results.board.settled_ties
    # Older ratings had no word for resamples.
    is_resampled = rating.intervals == Intervals.RESAMPLES.value
    notes: dict[str, Any] = {} if is_resampled else {"intervals": rating.intervals}
    if rating.covariates:
        notes["covariates"] = rating.covariates
    return {
        "format": "scenario-arena/leaderboard",
        "version": 1,
        "study": rating.study.name,
        "question": rating.question,
        "simulated": rating.includes_simulated,
        "early": rating.is_early,
        "method": {
            "name": rating.method,
            "text": table.method_text,
            "resampling_unit": rating.resampling_unit,
            **notes,
            "rounds": rating.rounds,
            "degenerate_rounds": rating.degenerate_rounds,
            "seed": rating.seed,
        },
        "votes": {
            "counted": rating.votes_cast,
            "left_out": table.left_out,
            "sha256": rating.votes_sha256,
            **({} if settled is None else {"settled_ties": settled}),
        },
        "preregistration": table.preregistration or None,
        "hypotheses": [_hypothesis(answer) for answer in table.hypotheses],
        "status": " ".join(table.reasons),
    }


def plain_text(table: LeaderboardTable) -> str:
    """The table for a terminal, with its method and warnings beneath."""
    lines = align_cells(print_lines(table.rows))
    left_out = ", ".join(f"{number} {reason}" for reason, number in table.left_out.items())
    lines += ["", *(f"{line}." for line in table.missing)]
    lines.append(f"{table.votes_text} counted; left out: {left_out or 'none'}.")
    lines.append(f"{table.method_text}.")
    if table.frozen_text:
        lines.append(f"{table.frozen_text[0].upper()}{table.frozen_text[1:]}.")
    lines += [_hypothesis_line(answer) for answer in table.hypotheses]
    return "\n".join([*lines, *table.warnings])


def leaderboard_latex(table: LeaderboardTable) -> bytes:
    """Return the paper's table with comments."""
    rating, board = table.snapshot, table.snapshot.results.board
    caption = caption_text(
        table.method_text,
        votes=rating.votes_cast,
        settled=board.settled_ties,
        experts=board.experts,
        scenarios=board.scenarios,
        more=f"{PLACES_LEFT} Rating {rating.code} of {rating.made_at:%Y-%m-%d}.",
    )
    heads, *cells = print_lines(table.rows)
    text = latex_table(
        ([_latex_name(row), *rest] for row, (_, *rest) in zip(table.rows, cells, strict=True)),
        heads=heads,
        comments=(
            f"{rating.study.name}: {table.votes_text}; {table.method_text}",
            f"votes sha256 {rating.votes_sha256}",
            *((table.frozen_text,) if table.frozen_text else ()),
            *table.warnings,
        ),
        notes=[*table.missing, *table.reasons],
        caption=f"{caption} ({', '.join(rating.marks)})" if rating.marks else caption,
    )
    return text.encode()


FORMATS: dict[str, formats.Format[LeaderboardTable]] = {
    **formats.table_formats(leaderboard_sheet),
    **formats.formats(json=leaderboard_json, latex=leaderboard_latex),
    **formats.drawings(interval_chart),
}


CHART_FORMATS: dict[str, formats.Format[Chart]] = formats.drawings(
    lambda chart, *, file_format: chart(file_format=file_format)
)


def draw_charts(pk: int) -> None:
    """Draw the charts of the rating with that key, in every format that no file keeps yet."""
    for chart in charts(Snapshot.objects.get(pk=pk)).values():
        for form in CHART_FORMATS.values():
            form.write(chart)


# --- Everything in one zip ---------------------------------------------------------------------


def bundle_files(snapshot: Snapshot) -> dict[str, bytes]:
    """Return everything about a rating by name, with a manifest.

    Raises:
        Conflict: The votes are not what they were when they were rated.
    """
    table, results = leaderboard_table(snapshot), snapshot.results
    votes = vote_table(snapshot)
    files = {
        f"leaderboard.{form.suffix}": form.write(table)
        for name, form in FORMATS.items()
        if name not in CHART_FORMATS
    }
    files |= {f"votes.{form.suffix}": form.write(votes) for form in VOTE_FORMATS.values()}
    files |= {
        f"{name}.{form.suffix}": form.write(chart)
        for name, chart in charts(snapshot).items()
        for form in CHART_FORMATS.values()
    }
    files["pairs.csv"] = _pairs_csv(results)
    files["types.csv"] = _types_csv(results)
    files["raters.csv"] = formats.make_csv(RATERS, results.trust.raters)
    if results.agreement:
        files["agreement.csv"] = AGREEMENT_FORMATS["csv"].write(snapshot)
    if frozen := snapshot.study.preregistration.encode():
        files[FILE_NAME] = frozen
    if table.hypotheses:
        files["hypotheses.csv"] = formats.make_csv(HYPOTHESES, table.hypotheses)
    files["statistics.json"] = formats.json_bytes(_statistics(results), sort_keys=True)
    files[MANIFEST] = formats.json_bytes(_manifest(table, files), sort_keys=True)
    return files


def chart_named(snapshot: Snapshot, *, name: str) -> Chart:
    """Return a chart of a rating.

    Raises:
        UnknownName: The rating has no such chart.
    """
    chart_functions = charts(snapshot)
    check_names("chart of this rating", [name], chart_functions)
    return chart_functions[name]


CHARTS = ("pairs", "types", "wish", "displacement", "elo-usd")
RATING_FILES = {
    "leaderboard": formats.Export(FORMATS, leaderboard_table, "the newest rating of a study"),
    "agreement": formats.Export(
        AGREEMENT_FORMATS,
        agreement_rating,
        "which metric agrees with experts, of the newest rating",
    ),
    "votes": formats.Export(
        VOTE_FORMATS, vote_table, "the votes of the newest rating, with pseudonyms"
    ),
    "all": formats.Export(formats.formats(zip=zip_bytes), bundle_files),
    **{name: formats.Export(CHART_FORMATS, partial(chart_named, name=name)) for name in CHARTS},
}
"""What a rating is offered as. PostgreSQL keeps the keys of stored documents in an order of its
own, so documents are sorted."""


def download_rating(snapshot: Snapshot, name: str, form: str) -> HttpResponse:
    """Answer with a file of RATING_FILES.

    Raises:
        Http404: There is no such file, or not of this rating.
        Conflict: The votes are not what they were when they were rated.
    """
    if name not in RATING_FILES or form not in RATING_FILES[name].formats:
        raise Http404
    try:
        made = RATING_FILES[name].make(snapshot)
    except UnknownName as error:
        raise Http404 from error
    stem = f"{slugify(snapshot.study.name) or 'study'}-{'rating' if name == 'all' else name}"
    return formats.download(RATING_FILES[name].formats, form, stem, made)


# --- Private -----------------------------------------------------------------------------------


def _is_old(table: LeaderboardTable) -> bool:
    return table.snapshot.results.board.settled_ties is None


def _standing(table: LeaderboardTable, row: Row) -> dict[str, Any]:
    part: dict[str, Any] = {"part": row.part} if table.has_parts else {}
    part |= {"card": dict(sorted(row.card.items()))} if row.card else {}
    return {
        column.key: formats.read_value(row, column.field)
        for column in list_columns(RATING, is_old=_is_old(table))
        if column.key
    } | part


def _latex_name(row: Row) -> str:
    """The model's name, its variant in typewriter letters as in the paper."""
    if not row.variant:
        return escape(row.model)
    before, _, after = row.model.rpartition(row.variant)
    return rf"{escape(before)}\texttt{{{escape(row.variant)}}}{escape(after)}"


def _hypothesis(answer: HypothesisAnswer) -> dict[str, Any]:
    above = answer.hypothesis.above
    return {
        "hypothesis": answer.hypothesis.text,
        "above": list(above) if above else None,
        "verdict": answer.verdict,
        "difference": None if answer.difference is None else round(answer.difference, 2),
        "p_adjusted": answer.p,
    }


def _hypothesis_line(answer: HypothesisAnswer) -> str:
    text = f"Hypothesis: {answer.hypothesis.text}"
    if answer.verdict is None:
        return text
    numbers = [] if answer.difference is None else [f"{answer.difference:+.0f} points"]
    if answer.p is not None:
        numbers.append(f"p {answer.p:.3f} adjusted")
    return f"{text}: {answer.verdict} ({', '.join(numbers) or 'unrated'})."


def _manifest(table: LeaderboardTable, files: dict[str, bytes]) -> dict[str, Any]:
    rating, judges = table.snapshot, table.snapshot.results.judges
    filters: dict[str, Any] = dict(rating.filters)
    if "experts" in filters:  # by pseudonym, as votes are
        filters["experts"] = sorted(
            judges.get(code, "without votes") for code in filters["experts"]
        )
    if "authors" in filters:
        filters["authors"] = len(filters["authors"])
    return _document(table) | {
        "format": "scenario-arena/rating",
        "rating": str(rating.code),
        "rated_at": rating.made_at.isoformat(),
        "warnings": table.warnings,
        "filters": filters,
        "versions": rating.versions,
        "files": describe_files(files),
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


def _pairs_csv(results: Results) -> bytes:
    """Return each pair, with its adjusted p value where the table has them."""
    names = ("a", "b", "wins", "ties", "losses", "both_miss", "planned")
    more = {"difference": "difference", "lower": "lower", "upper": "upper", "p_adjusted": "p"}
    if results.board.p_values is None:
        more = {}
    judged = {(value.a, value.b): value for value in results.board.p_values or ()}
    rows = (
        [
            *attrgetter(*names)(replace(pair, ties=pair.ties - (pair.settled or 0))),
            *(getattr(judged.get((pair.a, pair.b)), name, None) for name in more.values()),
            pair.settled,
        ]
        for pair in results.pairs
    )
    return _csv_with_ties([*names, *more], rows)


def _types_csv(results: Results) -> bytes:
    head = ("type", "contestant", "rank", "elo", "lower", "upper", "votes", "too_few", "note")
    read = attrgetter("slug", "rank", "rating", "lower", "upper", "votes", "few", "note")
    rows = (
        [part.type, *read(replace(line, votes=line.votes - (line.settled or 0))), line.settled]
        for part in results.types
        for line in part.lines
    )
    return _csv_with_ties(head, rows)


def _csv_with_ties(head: Sequence[str], rows: Iterable[list[Any]]) -> bytes:
    """Write rows that end with their unshown ties, which earlier ratings do not know."""
    written = list(rows)
    if all(row[-1] is None for row in written):
        return csv_text(head, [row[:-1] for row in written]).encode()
    return csv_text([*head, "settled_ties"], written).encode()


RATERS: dict[str, formats.Value] = {
    "judge": "name",
    "votes": "votes",
    "median_ms": "median_ms",
    "under_1_s": "fast",
    "ties": "ties",
    "left": "left.value",
    "agreement": "agreement.value",
    "shared": "shared",
    "favourites": "favourites.value",
    "decided": "decided",
    "repeats": lambda line: line.repeats[0],
    "repeats_same": lambda line: line.repeats[1],
    "checks": lambda line: line.checks[0],
    "checks_passed": lambda line: line.checks[1],
    "moves": "moves",
    "checks_skipped": "checks_skipped",
    "aids": lambda line: " ".join(f"{name}={number}" for name, number in line.aids),
}
HYPOTHESES: dict[str, formats.Value] = {
    "hypothesis": "hypothesis.text",
    "better": lambda answer: (answer.hypothesis.above or ("", ""))[0],
    "other": lambda answer: (answer.hypothesis.above or ("", ""))[1],
    "verdict": "verdict",
    "difference": "difference",
    "p_adjusted": "p",
}
