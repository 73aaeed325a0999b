"""The single answers of a judge as a file: two lines a pair, one for each order."""

from collections.abc import Iterator
from typing import NamedTuple

from arena.exports.formats import Value, csv_of
from arena.results.queries.judges import answers_of, judge_name
from augment.models import Augmentation, JudgeRun
from augment.services.running.judge_runs import exchange


class JudgeAnswerLine(NamedTuple):
    """One answer; A and B are what the judge was shown first and second."""

    judge: str
    question: str
    scenario: str
    order: int
    a: Augmentation
    b: Augmentation
    answer: str
    exchange: str
    reason: str


COLUMNS: dict[str, Value] = {
    **{name: name for name in ("judge", "question", "scenario", "order")},
    "picture_a": "a.contestant.slug",
    "picture_b": "b.contestant.slug",
    "augmentation_a": "a.code",
    "augmentation_b": "b.code",
    **{name: name for name in ("answer", "exchange", "reason")},
}
"""`exchange` says of both answers about a pair whether their preference was kept."""


def judge_answers_csv(run: JudgeRun) -> bytes:
    """Return all answers of a judge in the order of their pairs."""
    return csv_of(COLUMNS, _lines(run))


def _lines(run: JudgeRun) -> Iterator[JudgeAnswerLine]:
    for row in answers_of(run):
        became = exchange(row.first, row.second)
        about = judge_name(run), run.question, row.left.scenario.slug
        for order, a, b, answer, reason in (
            (1, row.left, row.right, row.first, row.first_reason),
            (2, row.right, row.left, row.second, row.second_reason),
        ):
            yield JudgeAnswerLine(*about, order, a, b, answer, became, reason)
