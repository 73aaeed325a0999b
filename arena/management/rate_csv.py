"""manage.py rate_csv without Django: it rates a file and needs neither settings nor a database.

manage.py comes here directly; `call_command("rate_csv")` takes the same way.
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence
from pathlib import Path

from arena.management.progress_line import ProgressLine
from arena.management.rated_csv import FORMATS, RatedCsv
from arena.rating.leaderboard import Intervals, Leaderboard, Method, Order, rate
from arena.rating.rules import TooManyContestants, Unit, default_intervals, unit_for
from arena.rating.votes_file import SIDE, VotesFile, VotesFileUnreadable, columns_of, read_votes
from augment.escaping import escape_controls

HELP = (
    "Rate votes from a file (CSV, JSON lines, Parquet): columns model_a, model_b, winner, and "
    "maybe judge and item."
)
METHODS = {one.value: one for one in Method}
_CLUSTERS = {
    Unit.VOTE: (),
    Unit.EXPERT: ("judge",),
    Unit.SCENARIO: ("item",),
    Unit.TWO_WAY: ("judge", "item"),
}
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
    options = vars(parser.parse_args(arguments))
    progress = ProgressLine(sys.stderr, time.monotonic)
    try:
        said = run(**options, progress=progress)
    except CsvNotRated as error:
        progress.end()
        print(escape_controls(f"CommandError: {error}"), file=sys.stderr)
        return 1
    progress.end()
    sys.stdout.write(escape_controls(said) if sys.stdout.isatty() else said)
    return 0


def add_arguments(parser: ArgumentParser) -> None:
    """Which file, and how."""
    parser.add_argument(
        "file", metavar="FILE", help="UTF-8 or UTF-16; winner is model_a, model_b or tie"
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        default="bt",
        help="bt is Bradley-Terry, davidson its model of ties",
    )
    parser.add_argument(
        "--resample",
        choices=[one.value for one in Unit],
        help="what hangs together: votes of an expert (judge), on a scenario (item), or two-way; "
        "two-way where judge and item are there, else what there is",
    )
    parser.add_argument(
        "--intervals",
        choices=[one.value for one in Intervals],
        help="closed form, or resamples; right for the method unless given",
    )
    parser.add_argument(
        "--order",
        choices=[one.value for one in Order],
        default=Order.SHUFFLED.value,
        help="online Elo's point: the median over shuffled rounds, or the order of the lines",
    )
    parser.add_argument(
        "--rounds",
        type=int,
        help=f"of the bootstrap; {ROUNDS}, above {MANY_VOTES} votes or {MANY_MODELS} models "
        f"{ROUNDS_OF_MANY}",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--adjust",
        nargs="+",
        default=(),
        metavar="WHAT",
        help="rate models as if alike in: side, or NAME of columns NAME_a and NAME_b of numbers",
    )
    parser.add_argument("--format", choices=FORMATS, default="table")


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
    _check_draws(method, intervals, rounds, seed)
    _check_columns(method, intervals, adjust)
    path = Path(file)
    try:
        columns = columns_of(path)
        chosen, notes = _resample(columns, method, resample)
        _check_there(columns, adjust)
        votes = read_votes(
            path,
            clusters=_CLUSTERS[chosen],
            covariates=adjust,
            in_order=method == "elo" and order == Order.RECORDED,
            report=progress.read if progress else None,
        )
    except VotesFileUnreadable as error:
        raise CsvNotRated(f"{path}: {error}") from error
    except OSError as error:
        raise CsvNotRated(f"{path}: {error.strerror}") from error
    default = _default_rounds(votes, METHODS[method], chosen, intervals)
    try:
        board = rate(
            votes.comparisons,
            method=METHODS[method],
            unit=chosen,
            intervals=Intervals(intervals) if intervals else None,
            order=Order(order),
            rounds=rounds or default,
            seed=seed,
            report=progress.drawn if progress else None,
        )
    except TooManyContestants as error:
        raise CsvNotRated(f"{path}: {error}") from error
    rated = RatedCsv(
        board=board,
        notes=_notes(board, votes, notes, is_default=rounds is None),
        knows_clusters=set(_CLUSTERS[chosen]) == {"judge", "item"} & set(columns),
        covariates=tuple(adjust),
    )
    return FORMATS[format](rated)


def _default_rounds(votes: VotesFile, method: Method, unit: Unit, intervals: str | None) -> int:
    counted = votes.comparisons
    kind = Intervals(intervals) if intervals else default_intervals(method, unit)
    takes_long = kind is Intervals.RESAMPLES and len(counted.names) > MANY_MODELS
    return ROUNDS_OF_MANY if takes_long or counted.votes > MANY_VOTES else ROUNDS


def _check_draws(method: str, intervals: str | None, rounds: int | None, seed: int) -> None:
    if rounds is not None and not 1 <= rounds <= MOST_ROUNDS:
        raise CsvNotRated(f"rounds go from 1 to {MOST_ROUNDS}, not {rounds}")
    if seed < 0:
        raise CsvNotRated(f"a seed is 0 or more, not {seed}")
    if method == "elo" and intervals == Intervals.CLOSED_FORM:
        raise CsvNotRated("elo has no intervals in closed form, only resamples")


def _check_columns(method: str, intervals: str | None, adjust: Sequence[str]) -> None:
    if adjust and (method != "bt" or intervals == "resamples"):
        raise CsvNotRated("--adjust needs --method bt with intervals in closed form")
    if len(set(adjust)) < len(adjust):
        raise CsvNotRated("--adjust names something twice")


def _check_there(columns: Sequence[str], adjust: Sequence[str]) -> None:
    needed = [f"{name}_{end}" for name in adjust if name != SIDE for end in "ab"]
    for name in needed:
        if name not in columns:
            raise VotesFileUnreadable(f"line 1: there is no column {name!r}, which --adjust needs")


def _resample(columns: Sequence[str], method: str, wanted: str | None) -> tuple[Unit, list[str]]:
    """What to draw, and a note where that was not asked for and is less than there could be."""
    if method == "elo":
        if wanted not in (None, "vote"):
            raise CsvNotRated(f"elo resamples single votes only; {wanted!r} needs --method bt")
        return Unit.VOTE, []
    if wanted is not None:
        missing = [name for name in _CLUSTERS[Unit(wanted)] if name not in columns]
        if missing:
            raise VotesFileUnreadable(
                f"line 1: there is no column {missing[0]!r}, which --resample {wanted} needs"
            )
        return Unit(wanted), []
    unit = unit_for(judges="judge" in columns, items="item" in columns)
    return unit, [_MISSING[unit]] if unit in _MISSING else []


_MISSING = {
    Unit.VOTE: "The file does not name both judge and item: single votes count as if they were "
    "independent, and if they are not, the intervals are too narrow.",
    Unit.EXPERT: "The file names no item: votes of one judge hang together, and if those on one "
    "item do as well, the intervals are too narrow.",
    Unit.SCENARIO: "The file names no judge: votes on one item hang together, and if those of one "
    "judge do as well, the intervals are too narrow.",
}


def _notes(
    board: Leaderboard, votes: VotesFile, notes: list[str], *, is_default: bool
) -> tuple[str, ...]:
    said = [board.explanation, *notes, *map(_in_their_words, board.warnings)]
    if is_default and board.intervals is Intervals.RESAMPLES and board.rounds < ROUNDS:
        said.append(
            f"Intervals rest on {board.rounds} resamples, because there are so many votes or "
            "models; --rounds sets another number."
        )
    if votes.repeats:
        said.append(
            f"{votes.repeats} votes repeat an earlier one of the same judge, item and pair; all "
            "are counted."
        )
    return tuple(filter(None, said))


def _in_their_words(warning: str) -> str:
    return warning.replace("expert", "judge").replace("scenario", "item")
