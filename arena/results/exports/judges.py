"""The single answers of a judge as a file: two lines a pair, one for each order."""

from collections.abc import Iterator

from arena.exports.cells import csv_text
from arena.results.queries.judges import judge_name, list_answered_pairs
from augment.models import JudgeRun
from augment.services.running import exchange

COLUMNS = (
    *("judge", "question", "scenario", "order", "picture_a", "picture_b"),
    *("augmentation_a", "augmentation_b", "answer", "exchange", "reason"),
)
"""A and B are what the judge was shown first and second; `exchange` says of both answers about a
pair whether their preference was kept."""


def judge_answers_csv(run: JudgeRun) -> bytes:
    """Return all answers of a judge in the order of their pairs."""
    return csv_text(COLUMNS, _rows(run)).encode()


def _rows(run: JudgeRun) -> Iterator[tuple[object, ...]]:
    for row in list_answered_pairs(run):
        about = judge_name(run), run.question, row.left.scenario.slug
        became = exchange(row.first, row.second).value
        for order, a, b, answer, reason in (
            (1, row.left, row.right, row.first, row.first_reason),
            (2, row.right, row.left, row.second, row.second_reason),
        ):
            shown = a.contestant.slug, b.contestant.slug, a.code, b.code
            yield *about, order, *shown, answer, became, reason
