"""manage.py rate_csv without Django: it rates a file and needs neither settings nor a database.

manage.py comes here directly; `call_command("rate_csv")` takes the same way.
"""

import json
import sys
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from arena.exports.cells import csv_text
from arena.exports.latex import PLACES_LEFT, align_cells, caption_text, escape, latex_table
from arena.exports.leaderboard import VOTES_FILE, list_columns, print_lines
from arena.rating import rules
from arena.rating.comparisons import LEVEL
from arena.rating.leaderboard import Intervals, Leaderboard, Method, rate
from arena.rating.lines import count_text, notes_by_reason, votes_text
from arena.rating.ranking import Separation
from arena.rating.remarks import remark_on_ignored
from arena.rating.votes_file import OPTIONAL, as_comparisons, read_table
from augment.escaping import escape_controls

HELP = (
    "Rate votes from a file (CSV, JSON, Parquet, Excel): columns model_a, model_b, winner, and "
    "maybe judge and item."
)
_COLUMN_OF_KIND = {"expert": "judge", "scenario": "item"}

COLUMNS = {column.name: str(column.field) for column in list_columns(VOTES_FILE)}
"""Those of CSV and JSON, by the fields of a line."""
_CLUSTERED = {
    rules.Unit.VOTE: "single votes",
    rules.Unit.EXPERT: "clustered by judge",
    rules.Unit.SCENARIO: "clustered by item",
    rules.Unit.TWO_WAY: "clustered by judge and item",
}


class CsvNotRated(ValueError):
    """The file or the options are not what they should be; the text says what is allowed."""


def main(arguments: Sequence[str]) -> int:
    """Rate a file and print; the exit code is 1 where that can't be done."""
    parser = ArgumentParser(prog="manage.py rate_csv", description=HELP)
    add_arguments(parser)
    try:
        printed = run(**vars(parser.parse_args(arguments)))
    except CsvNotRated as error:
        print(escape_controls(f"CommandError: {error}"), file=sys.stderr)
        return 1
    sys.stdout.write(escape_controls(printed) if sys.stdout.isatty() else printed)
    return 0


def add_arguments(parser: ArgumentParser) -> None:
    """Add the file and the options."""
    arguments: dict[str, dict[str, Any]] = {
        "file": {"metavar": "FILE", "help": "winner is model_a, model_b or tie"},
        "--method": {
            "choices": [method.value for method in Method],
            "default": "bt",
            "help": "bt is Bradley-Terry, davidson its model of ties",
        },
        "--resample": {
            "choices": [unit.value for unit in rules.Unit],
            "help": "clusters of dependent votes: by expert (judge), by scenario (item), or "
            "two-way; two-way where judge and item are there, else what there is; vote is the "
            "paper's resampling of single votes",
        },
        "--intervals": {
            "choices": [kind.value for kind in Intervals],
            "help": "bootstrap with effects of clusters, closed form, or resamples of single "
            "votes; right for the method unless given",
        },
        "--rounds": {
            "type": int,
            "help": f"{rules.BOOTSTRAP_ROUNDS} of the bootstrap, {rules.ROUNDS} of resamples; "
            f"{rules.ROUNDS_OF_MANY} above {rules.MANY_VOTES} votes or "
            f"{rules.MANY_CONTESTANTS} models",
        },
        "--seed": {"type": int, "default": 0},
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
    rounds: int | None = None,
    seed: int = 0,
    format: str = "table",
) -> str:
    """Return the text to print for a file.

    Raises:
        CsvNotRated: The file can't be read or the options don't fit it.
    """
    if rounds is not None and not rules.FEWEST_DRAWS <= rounds <= rules.MOST_DRAWS:
        raise CsvNotRated(
            f"rounds go from {rules.FEWEST_DRAWS} to {rules.MOST_DRAWS}, not {rounds}."
        )
    if seed < 0:
        raise CsvNotRated(f"a seed is 0 or more, not {seed}.")
    try:
        table = read_table(Path(file))
        there = [name for name in OPTIONAL if name in table.columns]
        unit = _choose_unit(there, Method(method), resample)
        clusters = [_COLUMN_OF_KIND[kind] for kind in unit.kinds]
        votes, repeats = as_comparisons(table, clusters)
        board = rate(
            votes,
            method=Method(method),
            unit=unit,
            intervals=Intervals(intervals) if intervals else None,
            rounds=rounds,
            seed=seed,
        )
    except OSError as error:
        raise CsvNotRated(f"{file}: {error.strerror}.") from error
    except ValueError as error:
        raise CsvNotRated(f"{file}: {str(error).rstrip('.')}.") from error
    unseen = [name for name in there if name not in clusters]
    if unseen:  # places left hold for a whole table
        lines = (replace(line, rank_best=None, rank_worst=None) for line in board.lines)
        board = replace(board, lines=tuple(lines))
    notes = [*_notes(board, there, unseen), table.note]
    if repeats:
        again = f"{count_text(repeats, 'vote|')} repeat{'s' * (repeats == 1)} an earlier one"
        notes.append(f"{again} of the same judge, item and pair; all are counted.")
    told_apart = None if unseen else board.told_apart
    return FORMATS[format](RatedCsv(board, tuple(filter(None, notes)), told_apart))


def _notes(board: Leaderboard, there: Sequence[str], unseen: Sequence[str]) -> list[str]:
    """Sentences on the ratings, and on columns that are missing or were not used."""
    warnings = [warning.replace("expert", "judge") for warning in board.warnings]
    why = board.explanation.replace("one expert", "one judge").replace("one scenario", "one item")
    notes = [why, *(warning.replace("scenario", "item") for warning in warnings)]
    if unknown := [
        name for name in OPTIONAL if name not in there and board.method is not Method.ELO
    ]:
        notes.insert(
            1,
            f"The file has no column {' and no column '.join(unknown)}: if votes are "
            "correlated by it, the intervals are too narrow.",
        )
    return notes + remark_on_ignored(unseen)


def _choose_unit(there: Sequence[str], method: Method, wanted: str | None) -> rules.Unit:
    if wanted is None:
        if method is Method.ELO:
            return rules.Unit.VOTE
        return rules.unit_for(judges="judge" in there, items="item" in there)
    for name in (_COLUMN_OF_KIND[kind] for kind in rules.Unit(wanted).kinds):
        if name not in there:
            raise ValueError(f"there is no column {name!r}, which --resample {wanted} needs")
    return rules.Unit(wanted)


# --- What is printed -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class RatedCsv:
    """Result for a file of votes.

    Attributes:
        told_apart: The pairs that differ with all judged at once; None where the intervals do not
            know of every column by which votes are clustered.
    """

    board: Leaderboard
    notes: tuple[str, ...]
    told_apart: Separation | None

    @property
    def method(self) -> str:
        """Method behind the numbers, in one line."""
        board = self.board
        drawn = f"{board.rounds:,} rounds, seed {board.seed}"
        intervals = {
            Intervals.BOOTSTRAP: f"bootstrap 95 % intervals, {drawn}, {_CLUSTERED[board.unit]}",
            Intervals.CLOSED_FORM: f"95 % intervals in closed form ({_CLUSTERED[board.unit]})",
            Intervals.RESAMPLES: f"95 % intervals by {board.rounds} resamples "
            f"({board.unit.value}), seed {board.seed}",
        }
        return f"{rules.METHOD_TEXTS[board.method]}; {intervals[board.intervals]}"

    @property
    def missing(self) -> list[str]:
        """Missing values with their lines and reasons."""
        return notes_by_reason((line.name, line.note) for line in self.board.standings)

    @property
    def has_places(self) -> bool:
        """True if some line has places left."""
        return any(line.rank_best is not None for line in self.board.lines)

    @property
    def records(self) -> list[dict[str, Any]]:
        """Values of each line in the columns of CSV and JSON."""
        return [
            {name: getattr(line, field) for name, field in COLUMNS.items()}
            for line in self.board.standings
        ]


def _write_table(rated: RatedCsv) -> str:
    rows = print_lines(rated.board.standings, has_places=rated.has_places)
    rows = [[escape_controls(" ".join(row[0].split())), *row[1:]] for row in rows]
    lines = align_cells(rows)
    lines += ["", *(" ".join(f"{line}.".split()) for line in rated.missing)]
    board = rated.board
    if board.tie_share is not None:
        lines.append(f"{rated.method}; {votes_text(board.votes, 0)}; {board.tie_share:.1%} ties.")
    if rated.told_apart is not None:
        models = len(board.lines)
        lines.append(
            f"{int(rated.told_apart.above.sum())} of {models * (models - 1) // 2} pairs are told "
            "apart with all of them judged at once, at 5 % for the whole table."
        )
    return "\n".join([*lines, *rated.notes, ""])


def _write_csv(rated: RatedCsv) -> str:
    """One line a model; what is unknown is empty. Notes go to the error output."""
    for note in rated.notes:
        print(escape_controls(note), file=sys.stderr)
    return csv_text(list(COLUMNS), [list(record.values()) for record in rated.records])


def _write_json(rated: RatedCsv) -> str:
    board = rated.board
    standings = rated.records
    if len({line.part for line in board.lines if line.rating is not None}) > 1:
        parts = (line.part for line in board.standings)
        standings = [
            record | {"part": part} for record, part in zip(standings, parts, strict=True)
        ]
    document: dict[str, Any] = {
        "method": board.method.value,
        "resample": board.unit.value,
        "intervals": board.intervals.value,
        "rounds": board.rounds,
        "degenerate_rounds": board.degenerate_rounds,
        "seed": board.seed,
        "votes": board.votes,
        "tie_share": board.tie_share,
        "status": board.status.value,
        "notes": list(rated.notes),
        "standings": standings,
        "pairs": None if rated.told_apart is None else _pairs(board, rated.told_apart),
    }
    return json.dumps(_round(document), indent=2, ensure_ascii=False) + "\n"


def _pairs(board: Leaderboard, separation: Separation) -> list[dict[str, Any]]:
    """Pairs with p-values adjusted for all of them."""
    pairs = separation.judge_pairs([line.name for line in board.lines])
    return [
        {
            **{name: getattr(pair, name) for name in ("a", "b", "difference", "lower", "upper")},
            "p_adjusted": pair.p,
            "told_apart": pair.p <= 1.0 - LEVEL,
        }
        for pair in pairs
    ]


def _round(value: Any) -> Any:
    """Round the numbers of a document to four decimals."""
    if isinstance(value, dict):
        return {name: _round(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return [_round(inner) for inner in value]
    return round(value, 4) if isinstance(value, float) else value


def _write_latex(rated: RatedCsv) -> str:
    board = rated.board
    # The paper's table, whose intervals are resamples, has no rank sets.
    has_places = rated.has_places and board.intervals is not Intervals.RESAMPLES
    heads, *cells = print_lines(board.standings, has_places=has_places)
    return latex_table(
        ((escape(name), *rest) for name, *rest in cells),
        comments=(f"{rated.method}; {votes_text(board.votes, 0)}", *rated.notes),
        heads=heads,
        notes=[*rated.missing, *board.reasons],
        caption=caption_text(
            rated.method,
            votes=board.votes,
            settled=0,
            experts=board.experts if rules.Unit.EXPERT in board.unit.kinds else 0,
            scenarios=board.scenarios if rules.Unit.SCENARIO in board.unit.kinds else 0,
            more=PLACES_LEFT if has_places else "",
        ),
    )


FORMATS: dict[str, Callable[[RatedCsv], str]] = {
    "table": _write_table,
    "csv": _write_csv,
    "json": _write_json,
    "latex": _write_latex,
}
