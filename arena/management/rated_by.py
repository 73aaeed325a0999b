"""What `rate_csv --by COLUMN` adds: ratings by what a column says, each drawn towards all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import restrict_to
from arena.rating.interactions import Interaction
from arena.rating.leaderboard import Leaderboard
from arena.rating.pooling import Pooled, pool_types
from arena.rating.printed import interval_text, rating_text
from arena.rating.type_interaction import type_interaction
from arena.rating.votes_file import VotesFile
from augment.sentences import escape_controls

PERMUTATIONS = 999
MOST_MODELS = 100
MOST_LABELS = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class ByLabel:
    """Ratings by label, of the models that are rated together.

    Attributes:
        column: Whose values the labels are.
        pooled: (T, C) ratings; None where there is nothing to pool, and `why` says so.
        test: Whether models differ by label.
    """

    column: str
    labels: tuple[str, ...]
    models: tuple[str, ...]
    votes: tuple[int, ...]
    pooled: Pooled | None
    test: Interaction | None
    why: str = ""


def by_label(votes: VotesFile, board: Leaderboard, column: str) -> ByLabel:
    """Rate by the labels of a file that was read with them."""
    assert votes.label_of is not None, "the file was read without labels"
    parts = [line.part for line in board.lines if line.rating is not None]
    main = max(set(parts), key=lambda part: (parts.count(part), -part), default=None)
    members = [
        number
        for number, line in enumerate(board.lines)
        if line.rating is not None and line.part == main
    ]
    models = tuple(board.lines[number].name for number in members)
    of_label = np.bincount(votes.label_of, votes.comparisons.count, len(votes.labels))
    nothing = ByLabel(
        column=column,
        labels=votes.labels,
        models=models,
        votes=tuple(of_label.astype(int).tolist()),
        pooled=None,
        test=None,
    )
    if not 2 <= len(votes.labels) <= MOST_LABELS or not 2 <= len(models) <= MOST_MODELS:
        why = f"{column}: 2 to {MOST_LABELS} values and 2 to {MOST_MODELS} models are needed."
        return replace(nothing, why=why)
    whole = votes.comparisons
    inside = np.isin(whole.first, members) & np.isin(whole.second, members)
    counting, label_of = restrict_to(whole, members), votes.label_of[inside]
    strengths = np.array([board.lines[number].rating for number in members], dtype=np.float64)
    return replace(
        nothing,
        pooled=pool_types(counting, label_of, len(votes.labels), board.unit),
        test=type_interaction(
            counting,
            label_of,
            votes.labels,
            strengths / ELO_PER_LOGIT,
            rounds=PERMUTATIONS,
            seed=board.seed,
        ),
    )


def by_lines(found: ByLabel) -> Iterator[str]:
    """Lines of text: a table a label, then the test."""
    if found.pooled is None:
        yield found.why or f"{found.column}: the votes determine no ratings to pool."
        return
    width = max(map(len, found.models))
    for number, label in enumerate(found.labels):
        yield f"{found.column} {escape_controls(label)}, {found.votes[number]} votes, pooled:"
        order = np.argsort(-found.pooled.rating[number], kind="stable").tolist()
        for place in order:
            rating, lower, upper = (
                float(values[number, place])
                for values in (found.pooled.rating, found.pooled.lower, found.pooled.upper)
            )
            name = escape_controls(found.models[place]).ljust(width)
            yield f"  {name}  {rating_text(rating)}  {interval_text(rating, lower, upper)}"
        yield ""
    spread = found.pooled.spread
    yield (
        f"Between values of {found.column} models differ by a standard deviation of "
        f"{spread.value:.0f} points (95 % {spread.lower:.0f} to {spread.upper:.0f})."
    )
    if found.test is not None and found.test.p_value is not None:
        yield (
            f"Models against {found.column}: score test {found.test.statistic:.1f} on "
            f"{found.test.freedom} degrees of freedom, p {found.test.p_value:.2g} by "
            f"{found.test.rounds} permutations of items."
        )


def by_document(found: ByLabel) -> dict[str, Any]:
    """The same for JSON."""
    pooled, test = found.pooled, found.test
    return {
        "column": found.column,
        "why_not": found.why or None,
        "spread": None if pooled is None else round(pooled.spread.value or 0.0, 4),
        "test": None
        if test is None
        else {"statistic": round(test.statistic, 4), "df": test.freedom, "p": test.p_value},
        "values": [
            {
                "value": label,
                "votes": found.votes[number],
                "pooled": []
                if pooled is None
                else [
                    {
                        "model": model,
                        "rating": round(float(pooled.rating[number, place]), 4),
                        "lower": round(float(pooled.lower[number, place]), 4),
                        "upper": round(float(pooled.upper[number, place]), 4),
                    }
                    for place, model in enumerate(found.models)
                ],
            }
            for number, label in enumerate(found.labels)
        ],
    }
