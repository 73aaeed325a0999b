"""manage.py rate_csv without Django: it rates a file and needs neither settings nor a database.

manage.py comes here directly; `call_command("rate_csv")` takes the same way.
"""

import json
import sys
import time
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from arena.exports.cells import csv_text
from arena.management.progress_line import ProgressLine
from arena.rating.leaderboard import Intervals, Leaderboard, Line, Method, Order, rate
from arena.rating.lines import HEADS as PAPERS_HEADS
from arena.rating.lines import caption_text, escape, latex_table, notes_by_reason
from arena.rating.logistic import Coefficient
from arena.rating.ranking import Separation
from arena.rating.rules import METHOD_TEXTS, TooManyContestants, Unit, default_intervals, unit_for
from arena.rating.votes_file import SIDE, VotesFile, VotesFileUnreadable, columns_of, read_votes
from augment.escaping import escape_controls

HELP = (
    "Rate votes from a file (CSV, JSON lines, Parquet): columns model_a, model_b, winner, and "
    "maybe judge and item."
)
_COLUMN_OF_KIND = {"expert": "judge", "scenario": "item"}
ROUNDS, ROUNDS_OF_MANY, MANY_VOTES, MANY_MODELS = 10_000, 1000, 500_000, 100
MOST_ROUNDS = 100_000


class CsvNotRated(ValueError):
    """The file or the options are not what they should be; the text says what is allowed."""


def main(arguments: Sequence[str]) -> int:
    """Rate a file and print; the exit code is 1 where that can't be done."""
    parser = ArgumentParser(
        prog="manage.py rate_csv", description=HELP, formatter_class=RawDescriptionHelpFormatter
    )
    add_arguments(parser)
    progress = ProgressLine(sys.stderr, time.monotonic)
    try:
        printed = run(**vars(parser.parse_args(arguments)), progress=progress)
    except CsvNotRated as error:
        progress.end()
        print(escape_controls(f"CommandError: {error}"), file=sys.stderr)
        return 1
    progress.end()
    sys.stdout.write(escape_controls(printed) if sys.stdout.isatty() else printed)
    return 0


def add_arguments(parser: ArgumentParser) -> None:
    """Which file, and how."""
    arguments: dict[str, dict[str, Any]] = {
        "file": {"metavar": "FILE", "help": "UTF-8 or UTF-16; winner is model_a, model_b or tie"},
        "--method": {
            "choices": [method.value for method in Method],
            "default": "bt",
            "help": "bt is Bradley-Terry, davidson its model of ties",
        },
        "--resample": {
            "choices": [unit.value for unit in Unit],
            "help": "what hangs together: votes of an expert (judge), on a scenario (item), or "
            "two-way; two-way where judge and item are there, else what there is",
        },
        "--intervals": {
            "choices": [kind.value for kind in Intervals],
            "help": "closed form, or resamples; right for the method unless given",
        },
        "--order": {
            "choices": [order.value for order in Order],
            "default": Order.SHUFFLED.value,
            "help": "online Elo's point: the median over shuffled rounds, or the order of the "
            "lines",
        },
        "--rounds": {
            "type": int,
            "help": f"of the bootstrap; {ROUNDS}, above {MANY_VOTES} votes or {MANY_MODELS} "
            f"models {ROUNDS_OF_MANY}",
        },
        "--seed": {"type": int, "default": 0},
        "--adjust": {
            "nargs": "+",
            "default": (),
            "metavar": "WHAT",
            "help": "rate models as if alike in: side, or NAME of columns NAME_a and NAME_b of "
            "numbers",
        },
        "--format": {"choices": FORMATS, "default": "table"},
    }
    for flag, how in arguments.items():
        parser.add_argument(flag, **how)


def run(
    *,
    file: str,
    method: str = "bt",
    resample: str | None = None,
    intervals: str | None = None,
    order: str = "shuffled",
    rounds: int | None = None,
    seed: int = 0,
    adjust: Sequence[str] = (),
    format: str = "table",
    progress: ProgressLine | None = None,
) -> str:
    """What to print for a file.

    Raises:
        CsvNotRated: The file can't be read or the options don't fit it.
    """
    _check_options(method, intervals, rounds, seed, adjust)
    path = Path(file)
    try:
        columns = columns_of(path)
        unit, note = _choose_unit(columns, method, resample)
        _check_columns(columns, adjust)
        clusters = [_COLUMN_OF_KIND[kind] for kind in unit.kinds]
        votes = read_votes(
            path,
            clusters=clusters,
            covariates=adjust,
            in_order=method == "elo" and order == Order.RECORDED,
            report=progress.read if progress else None,
        )
        kind = Intervals(intervals) if intervals else default_intervals(Method(method), unit)
        board = rate(
            votes.comparisons,
            method=Method(method),
            unit=unit,
            intervals=kind,
            order=Order(order),
            rounds=rounds or _default_rounds(votes, kind),
            seed=seed,
            report=progress.drawn if progress else None,
        )
    except (VotesFileUnreadable, TooManyContestants) as error:
        raise CsvNotRated(f"{path}: {error}") from error
    except OSError as error:
        raise CsvNotRated(f"{path}: {error.strerror}") from error
    rated = RatedCsv(
        board=board,
        notes=_notes(board, votes, note, is_default=rounds is None),
        knows_clusters=set(clusters) == {"judge", "item"} & set(columns),
        covariates=tuple(adjust),
    )
    return FORMATS[format](rated)


def _default_rounds(votes: VotesFile, kind: Intervals) -> int:
    counted = votes.comparisons
    takes_long = kind is Intervals.RESAMPLES and len(counted.names) > MANY_MODELS
    return ROUNDS_OF_MANY if takes_long or counted.votes > MANY_VOTES else ROUNDS


def _check_options(
    method: str, intervals: str | None, rounds: int | None, seed: int, adjust: Sequence[str]
) -> None:
    refusals = {
        f"rounds go from 1 to {MOST_ROUNDS}, not {rounds}": rounds is not None
        and not 1 <= rounds <= MOST_ROUNDS,
        f"a seed is 0 or more, not {seed}": seed < 0,
        "elo has no intervals in closed form, only resamples": method == "elo"
        and intervals == Intervals.CLOSED_FORM,
        "--adjust needs --method bt with intervals in closed form": bool(adjust)
        and (method != "bt" or intervals == Intervals.RESAMPLES),
        "--adjust names something twice": len(set(adjust)) < len(adjust),
    }
    for sentence, is_refused in refusals.items():
        if is_refused:
            raise CsvNotRated(sentence)


def _check_columns(columns: Sequence[str], adjust: Sequence[str]) -> None:
    for name in (f"{name}_{end}" for name in adjust if name != SIDE for end in "ab"):
        if name not in columns:
            raise VotesFileUnreadable(f"line 1: there is no column {name!r}, which --adjust needs")


def _choose_unit(columns: Sequence[str], method: str, wanted: str | None) -> tuple[Unit, str]:
    """What to draw, and a note where that was not asked for and is less than there could be."""
    if method == "elo":
        if wanted not in (None, "vote"):
            raise CsvNotRated(f"elo resamples single votes only; {wanted!r} needs --method bt")
        return Unit.VOTE, ""
    if wanted is None:
        unit = unit_for(judges="judge" in columns, items="item" in columns)
        return unit, _MISSING.get(unit, "")
    for name in (_COLUMN_OF_KIND[kind] for kind in Unit(wanted).kinds):
        if name not in columns:
            raise VotesFileUnreadable(
                f"line 1: there is no column {name!r}, which --resample {wanted} needs"
            )
    return Unit(wanted), ""


_MISSING = {
    Unit.VOTE: "The file does not name both judge and item: single votes count as if they were "
    "independent, and if they are not, the intervals are too narrow.",
    Unit.EXPERT: "The file names no item: votes of one judge hang together, and if those on one "
    "item do as well, the intervals are too narrow.",
    Unit.SCENARIO: "The file names no judge: votes on one item hang together, and if those of one "
    "judge do as well, the intervals are too narrow.",
}


def _notes(
    board: Leaderboard, votes: VotesFile, note: str, *, is_default: bool
) -> tuple[str, ...]:
    warnings = [
        warning.replace("expert", "judge").replace("scenario", "item")
        for warning in board.warnings
    ]
    notes = [board.explanation, note, *warnings]
    if is_default and board.intervals is Intervals.RESAMPLES and board.rounds < ROUNDS:
        notes.append(
            f"Intervals rest on {board.rounds} resamples, because there are so many votes or "
            "models; --rounds sets another number."
        )
    if votes.repeats:
        notes.append(
            f"{votes.repeats} votes repeat an earlier one of the same judge, item and pair; all "
            "are counted."
        )
    return tuple(filter(None, notes))


# --- What is printed -----------------------------------------------------------------------------


COLUMNS = ("model", "rank", "elo", "lower", "upper", "votes", "note", "rank_best", "rank_worst")
"""Those of CSV and JSON; a new one comes at the end."""
HEADS = (*PAPERS_HEADS, "95% ranks")
_CLUSTERED = {
    Unit.VOTE: "single votes",
    Unit.EXPERT: "clustered by judge",
    Unit.SCENARIO: "clustered by item",
    Unit.TWO_WAY: "clustered by judge and item",
}
MOST_PAIRS = 100_000
"""Above so many pairs JSON holds only those that are told apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RatedCsv:
    """What came out for a file, and how it was asked.

    Attributes:
        knows_clusters: Whether the intervals know of every column by which votes hang together.
    """

    board: Leaderboard
    notes: tuple[str, ...]
    knows_clusters: bool
    covariates: tuple[str, ...] = ()

    @property
    def told_apart(self) -> Separation | None:
        """The pairs that differ with all judged at once; None where that can't be said."""
        return self.board.told_apart if self.knows_clusters else None

    @property
    def missing(self) -> list[str]:
        """What is missing in which lines, and why."""
        return notes_by_reason((line.name, line.note) for line in self.board.standings)

    @property
    def how(self) -> str:
        """How the numbers came about."""
        board = self.board
        found = (
            f"in closed form ({_CLUSTERED[board.unit]})"
            if board.intervals is Intervals.CLOSED_FORM
            else f"by {board.rounds} resamples ({board.unit.value})"
        )
        adjusted = f", adjusted for {', '.join(self.covariates)}" if board.coefficients else ""
        text = f"{METHOD_TEXTS[board.method]}{adjusted}; 95 % intervals {found}"
        return f"{text}, seed {board.seed}"

    @property
    def coefficients(self) -> list[tuple[str, Coefficient]]:
        """What is adjusted for; none where the votes do not determine what it is worth."""
        return list(zip(self.covariates, self.board.coefficients, strict=False))

    def cells(self) -> Iterator[tuple[str, ...]]:
        """Yield model, rank, rating, interval, votes and rank set of each line."""
        for line in self.board.standings:
            texts = (line.rank_text, line.elo_text, line.interval_text)
            yield line.name, *texts, str(line.votes), line.ranks_text


def _write_table(rated: RatedCsv) -> str:
    rows = [HEADS, *rated.cells()]
    rows = [(escape_controls(" ".join(row[0].split())), *row[1:]) for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    head, *lines = [
        "  ".join(
            [row[0].ljust(widths[0])]
            + [text.rjust(width) for text, width in zip(row[1:], widths[1:], strict=True)]
        )
        for row in rows
    ]
    missing = [" ".join(f"{line}.".split()) for line in rated.missing]
    return "\n".join(
        [head, *_under_groups(rated, lines), "", *missing, *_summary(rated), *rated.notes, ""]
    )


def _under_groups(rated: RatedCsv, lines: list[str]) -> Iterator[str]:
    """The lines of models, with a head over each group where they were never compared."""
    parts = [line.part for line in rated.board.standings]
    several = len({part for part in parts if part >= 0}) > 1
    for place, (part, line) in enumerate(zip(parts, lines, strict=True)):
        if several and (place == 0 or part != parts[place - 1]):
            yield f"group {part + 1}, rated by itself:" if part >= 0 else "not rated:"
        yield line


def _summary(rated: RatedCsv) -> Iterator[str]:
    """The method, how many pairs are told apart, and the covariates."""
    board = rated.board
    if board.tie_share is not None:
        yield f"{rated.how}; {board.votes} votes; {board.tie_share:.1%} ties."
    if (found := rated.told_apart) is not None:
        models = len(board.lines)
        yield (
            f"{int(found.above.sum())} of {models * (models - 1) // 2} pairs are told apart with "
            "all of them judged at once, at 5 % for the whole table."
        )
    for name, coefficient in rated.coefficients:
        points = coefficient.points
        text = f"{name}: {points.value:+.1f} points for one"
        if points.lower is not None and coefficient.p_value is not None:
            text += f", 95 % {points.lower:+.1f} to {points.upper:+.1f}"
            text += f", p {coefficient.p_value:.2g}"
        yield f"{text}."


def _write_csv(rated: RatedCsv) -> str:
    """One line a model; what is unknown is empty. Notes go to the other formats."""
    for note in rated.notes:
        print(escape_controls(note), file=sys.stderr)
    lines = rated.board.standings
    return csv_text(COLUMNS, ([_value(line, column) for column in COLUMNS] for line in lines))


def _write_json(rated: RatedCsv) -> str:
    board = rated.board
    parts = {line.part for line in board.lines if line.rating is not None}
    document: dict[str, Any] = {
        "method": board.method.value,
        "resample": board.unit.value,
        "intervals": board.intervals.value,
        "rounds": board.rounds,
        "degenerate_rounds": board.degenerate_rounds,
        "seed": board.seed,
        "votes": board.votes,
        "tie_share": _rounded(board.tie_share),
        "status": board.status.value,
        "notes": list(rated.notes),
        "standings": [
            {column: _rounded(_value(line, column)) for column in COLUMNS}
            | ({"part": line.part} if len(parts) > 1 else {})
            for line in board.standings
        ],
        "pairs": _pairs(board, rated.told_apart),
    }
    if rated.covariates:
        document["covariates"] = [
            {
                "name": name,
                "points": _rounded(coefficient.points.value),
                "lower": _rounded(coefficient.points.lower),
                "upper": _rounded(coefficient.points.upper),
                "p": _rounded(coefficient.p_value),
            }
            for name, coefficient in rated.coefficients
        ]
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _write_latex(rated: RatedCsv) -> str:
    board = rated.board
    in_paper = board.intervals is Intervals.RESAMPLES  # whose table has no rank sets
    heads = PAPERS_HEADS if in_paper else HEADS
    return latex_table(
        ((escape(name), *rest)[: len(heads)] for name, *rest in rated.cells()),
        comments=(f"{rated.how}; {board.votes} votes", *rated.notes),
        heads=heads,
        notes=rated.missing,
        caption=caption_text(
            rated.how, votes=board.votes, experts=board.experts, scenarios=board.scenarios
        ),
    )


def _pairs(board: Leaderboard, found: Separation | None) -> list[dict[str, Any]] | None:
    """Pairs with p-values adjusted for all of them; None where these were not judged."""
    if found is None:
        return None
    low, high = np.triu_indices(len(board.lines), 1)
    shown = ~np.isnan(found.p_value[low, high])
    if len(low) > MOST_PAIRS:
        shown &= (found.above | found.above.T)[low, high]
    return [
        {
            "a": board.lines[i].name,
            "b": board.lines[j].name,
            "difference": _rounded(float(found.difference[i, j])),
            "lower": _rounded(float(found.difference[i, j] - found.half[i, j])),
            "upper": _rounded(float(found.difference[i, j] + found.half[i, j])),
            "p_adjusted": float(found.p_value[i, j]),
            "told_apart": bool(found.above[i, j] or found.above[j, i]),
        }
        for i, j in zip(low[shown].tolist(), high[shown].tolist(), strict=True)
    ]


def _value(line: Line, column: str) -> Any:
    """What a line has in a column of CSV and JSON."""
    return getattr(line, {"model": "name", "elo": "rating"}.get(column, column))


def _rounded(value: Any) -> Any:
    return round(value, 4) if isinstance(value, float) else value


FORMATS: dict[str, Callable[[RatedCsv], str]] = {
    "table": _write_table,
    "csv": _write_csv,
    "json": _write_json,
    "latex": _write_latex,
}
