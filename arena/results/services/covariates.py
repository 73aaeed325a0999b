"""What a rating can adjust for, as columns beside its votes: the side, and how much was shown."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from arena.models import Study, Vote
from arena.pairing.order import MAIN
from arena.pairing.rules import scenario_of
from arena.rating.comparisons import Comparisons, FloatArray
from arena.rating.lines import whole_percent
from arena.results.queries.votes import AUTOMATIC, Judged, VoteSet
from augment.models import Augmentation

SIDE, OBJECTS, VEHICLES = "side", "objects", "vehicles"
COVARIATES = (SIDE, OBJECTS, VEHICLES)
"""Being on the left; by how many more objects, or vehicles, a picture marks as added or moved."""
WITHOUT_PICTURES = (SIDE,)
"""What is known of votes from a file."""

_VEHICLES = {"VEHICLE", "BUS"}
"""Of the types that a modification's document knows."""
_AT_ONCE = 500


def with_covariates(
    comparisons: Comparisons, votes: Sequence[Judged], names: Sequence[str]
) -> Comparisons:
    """The same votes with what to adjust for, seen from the left.

    Args:
        comparisons: Of these votes, a row each.
        votes: In the same order.
        names: Of COVARIATES.
    """
    if not names:
        return comparisons
    columns: dict[str, FloatArray] = {SIDE: np.ones(len(votes))}
    if set(names) - {SIDE}:
        counts = _count_changes(
            {code for vote in votes for code in (vote.left_code, vote.right_code)}
        )
        more = np.array([counts[vote.left_code] - counts[vote.right_code] for vote in votes])
        columns[OBJECTS], columns[VEHICLES] = more.reshape(-1, 2).T
    return replace(comparisons, covariates=np.column_stack([columns[name] for name in names]))


def _count_changes(codes: set[str]) -> defaultdict[str, FloatArray]:
    """(2,) objects and vehicles that an augmentation adds or moves, by its code."""
    found: defaultdict[str, FloatArray] = defaultdict(lambda: np.zeros(2))
    known = sorted(code for code in codes if code)
    for first in range(0, len(known), _AT_ONCE):
        rows = Augmentation.objects.filter(code__in=known[first : first + _AT_ONCE])
        for code, document in rows.values_list("code", "modification"):
            changed = [*(document or {}).get("add", []), *(document or {}).get("move", [])]
            vehicles = sum(agent["type"] in _VEHICLES for agent in changed)
            found[str(code)] = np.array([len(changed), vehicles], dtype=np.float64)
    return found


def settled_remark(study: Study, votes: VoteSet, *, left_out: bool) -> str:
    """Return what the table estimates where pairs were settled, empty where none was.

    Args:
        study: What was planned.
        votes: That count.
        left_out: Whether settled pairs are left out.
    """
    settled = len(study.rules.get("identical", ()))
    if not settled:
        return ""
    ties = sum(vote.kind == AUTOMATIC for vote in votes.counted)
    said = (
        f"The table says how contestants compare where their pictures differ: {settled} pairs "
        "that nobody can tell apart were not shown and are left out."
        if left_out
        else f"The table says how contestants compare over all pairs of pictures: {settled} "
        f"pairs that nobody can tell apart were not shown and count as {ties} ties, as many a "
        "pair as others have votes on average."
    )
    return f"{said} {_on_those_shown(study, votes)}".strip()


def _on_those_shown(study: Study, votes: VoteSet) -> str:
    """The tie share of alike pairs that experts were shown all the same."""
    shown = {
        (scenario_of(place), frozenset((one, other)))
        for place, one, other in study.rules.get("alike_shown", ())
    }
    given = [
        vote.outcome == Vote.Outcome.EQUAL
        for vote in votes.counted
        if vote.kind == MAIN and (vote.item, frozenset((vote.left, vote.right))) in shown
    ]
    if not given:
        return ""
    return (
        f"Of {len(given)} votes on {len(shown)} such pairs that were shown all the same, "
        f"{sum(given)} are ties ({whole_percent(sum(given) / len(given))} %)."
    )
