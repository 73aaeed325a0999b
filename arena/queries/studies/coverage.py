"""How the plan of a study is spread over its contestants and pairs, and how far it is judged.

Nothing here tells who wins, so it may be seen while the study is open.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import combinations

from django.db.models import Count, Exists, OuterRef, QuerySet
from django.db.models.functions import Greatest, Least

from arena.models import Matchup, Report, Study, Vote
from arena.queries.remembering import Remembered, plan_and_votes

_Counts = tuple[tuple[int, int, str, bool, int], ...]
"""Contestants of left and right, kind, whether there is a vote, and how many such matchups."""

_COUNTED: Remembered[tuple[_Counts, int, int]] = Remembered(8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Covered:
    """Something planned, and how much of it has a vote; a skip is none."""

    name: str
    planned: int
    decided: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """The plan of a study.

    Attributes:
        contestants: In how many main matchups each one is shown.
        pairs: The main matchups of each pair, the least judged first.
        kinds: Main matchups, hidden repeats and attention checks, named by their values.
        identical: Pairs with identical pictures, which nobody is shown.
        units: Units of the main matchups: a pair on one picture each.
        shared: Those that two experts or more are to judge.
    """

    contestants: tuple[Covered, ...]
    pairs: tuple[Covered, ...]
    kinds: tuple[Covered, ...]
    identical: int
    units: int = 0
    shared: int = 0

    @property
    def fewest(self) -> Covered | None:
        """The pair that is judged least."""
        return self.pairs[0] if self.pairs else None


def coverage(study: Study) -> Coverage:
    """The plan of a study, in five queries; in three where nothing came in since the last time."""
    return _coverage(study, *_COUNTED.get(plan_and_votes(study), lambda: _count(study)))


def _coverage(study: Study, counts: _Counts, units: int, shared: int) -> Coverage:
    names = dict(study.contestants.order_by("name").values_list("pk", "name"))
    shown: Counter[int] = Counter()
    decided: Counter[int] = Counter()
    pairs: Counter[frozenset[int]] = Counter()
    judged: Counter[frozenset[int]] = Counter()
    kinds: Counter[str] = Counter()
    done: Counter[str] = Counter()
    for left, right, kind, has_vote, n in counts:
        kinds[kind] += n
        done[kind] += n * has_vote
        if kind == Matchup.Kind.MAIN:
            pair = frozenset((left, right))
            pairs[pair] += n
            judged[pair] += n * has_vote
            for contestant in pair:
                shown[contestant] += n
                decided[contestant] += n * has_vote
    lines = (
        Covered(
            name=f"{names[one]} / {names[other]}",
            planned=pairs[frozenset((one, other))],
            decided=judged[frozenset((one, other))],
        )
        for one, other in combinations(names, 2)
    )
    return Coverage(
        units=units,
        shared=shared,
        contestants=tuple(
            Covered(name=name, planned=shown[pk], decided=decided[pk])
            for pk, name in names.items()
        ),
        pairs=tuple(sorted(lines, key=lambda line: (line.decided, line.planned, line.name))),
        kinds=tuple(
            Covered(name=kind.value, planned=kinds[kind.value], decided=done[kind.value])
            for kind in Matchup.Kind
            if kinds[kind.value]
        ),
        identical=len(study.rules.get("identical", ())),
    )


def shared_units(study: Study) -> tuple[int, int]:
    """How many units the main matchups have, and how many two experts or more are to judge."""
    mains = study.matchups.filter(kind=Matchup.Kind.MAIN).order_by()
    sides = (Least("left", "right"), Greatest("left", "right"))
    judged = mains.values(one=sides[0], other=sides[1]).annotate(n=Count("expert", distinct=True))
    counts = list(judged.values_list("n", flat=True))
    return len(counts), sum(number > 1 for number in counts)


def reports_of(study: Study) -> QuerySet[Report]:
    """What experts reported, the youngest first."""
    reports = Report.objects.filter(matchup__study=study).order_by("-at", "-pk")
    return reports.select_related("expert__person", "matchup__scenario").defer(
        "matchup__scenario__reference"
    )


# --- Private -----------------------------------------------------------------------------------


def _count(study: Study) -> tuple[_Counts, int, int]:
    return tuple(_counts(study)), *shared_units(study)


def _counts(study: Study) -> QuerySet[Matchup, tuple[int, int, str, bool, int]]:
    votes = Vote.objects.filter(matchup=OuterRef("pk"), superseded_by=None)
    has_vote = Exists(votes.exclude(outcome=Vote.Outcome.SKIP))
    return (
        study.matchups.order_by()
        .annotate(has_vote=has_vote)
        .values("left__contestant", "right__contestant", "kind", "has_vote")
        .annotate(n=Count("pk"))
        .values_list("left__contestant", "right__contestant", "kind", "has_vote", "n")
    )
