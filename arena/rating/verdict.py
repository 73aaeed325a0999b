"""The answer of a rated table in one sentence: who can't be told apart, who is worse than whom.

In: the lines of a table, best first, and the pairs that it tells apart. Out: plain English.
"""

from collections.abc import Collection, Sequence
from functools import partial

from arena.rating.lines import Line

Pairs = Collection[tuple[int, int]]
"""Who is above whom, by places in the table from 0, the better one first."""

MOST_NAMED = 6
"""Of more contestants the number is said instead of their names."""
MOST_CLAUSES = 5
"""What comes after so many is left to the table."""

_ALL = ("", "", "both", "all three", "all four", "all five", "all six", "all seven", "all eight")


def verdict(
    lines: Sequence[Line], votes: int, apart: Pairs | None, *, is_few: bool = False
) -> str:
    """Say in one sentence who is better than whom.

    Args:
        lines: Best first; who has no votes is passed over.
        votes: How many were counted.
        apart: Who differs with all pairs judged at once: nobody else is called better. None where
            nothing was judged so.
        is_few: Whether that rests on few experts or scenarios, so that the sentence hedges.
    """
    judged = [place for place, line in enumerate(lines) if line.votes]
    if not judged:
        return "There are no votes to rate."
    counted = f" with {votes} vote{'' if votes == 1 else 's'}"
    if len(judged) == 1:
        return f"{lines[judged[0]].name} has nobody to be compared with."
    if apart is None and any(line.has_bound for line in lines):
        return f"Who is better is not judged{counted}."
    tell = partial(_compare, [line.name for line in lines], apart=apart or [], is_few=is_few)
    parts = sorted({lines[place].part for place in judged} - {-1})
    if len(parts) < 2:
        return f"{tell(judged, counted=counted)}."
    groups = [[place for place in judged if lines[place].part == part] for part in parts]
    comparisons = "; ".join(tell(group, counted="") for group in groups)
    return f"{votes} votes leave {len(parts)} groups that can’t be compared: {comparisons}."


# --- Private -----------------------------------------------------------------------------------


def _compare(
    names: Sequence[str], places: Sequence[int], *, apart: Pairs, counted: str, is_few: bool
) -> str:
    """The clauses about contestants that were compared with each other, the best ones first."""
    one_is, many_are, order_is = (
        ("seems", "seem", "seems to be") if is_few else ("is", "are", "is")
    )
    best, *rest = _tiers(places, apart)
    is_chain = len(best) == 1 and len(rest) == len(places) - 1
    if is_chain and all((a, b) in apart for a in places for b in places if a < b) and rest[1:]:
        order = ", then ".join(names[place] for place in places)
        return f"The order {order_is} {order}{'' if is_few else ': all are told apart'}{counted}"
    if len(best) > 1:
        clauses = [f"{_join_names(names, best, len(places))} can’t be told apart{counted}"]
    else:
        below = [place for place in places if (best[0], place) in apart]
        all_others = f"{_ALL[len(below)]} others" if len(below) < len(_ALL) else "all others"
        worse = all_others if 1 < len(below) == len(places) - 1 else _join_names(names, below)
        clauses = [f"{names[best[0]]} {one_is} better than {worse}{counted}"]
    before = list(best)
    for tier in rest:
        by_betters: dict[tuple[int, ...], list[int]] = {}
        for place in tier:
            betters = tuple(better for better in before if (better, place) in apart)
            by_betters.setdefault(betters, []).append(place)
        for betters, members in by_betters.items():
            verb = one_is if len(members) == 1 else many_are
            if list(betters) != best or len(best) > 1:
                whom = _better_ones(names, betters, before)
                clauses.append(f"{_join_names(names, members)} {verb} worse than {whom}")
            elif len(members) > 1:
                clauses.append(f"{_join_names(names, members)} can’t be told apart")
        before += tier
    more = ["the table has the rest"] if len(clauses) > MOST_CLAUSES else []
    return "; ".join(clauses[:MOST_CLAUSES] + more)


def _tiers(places: Sequence[int], apart: Pairs) -> list[list[int]]:
    """Return tiers: those with nobody above, then those with nobody of the rest above, ..."""
    left, tiers = list(places), []
    while left:
        # Peeled from the top: places whose betters are all in tiers before.
        tier = [place for place in left if not any((other, place) in apart for other in left)]
        tiers.append(tier)
        left = [place for place in left if place not in tier]
    return tiers


def _join_names(names: Sequence[str], places: Sequence[int], total: int = 0) -> str:
    if len(places) > MOST_NAMED:
        of = "The" if len(places) == total else f"{len(places)} of the" if total else ""
        number = total or len(places)
        return f"{of} {number} contestants".strip()
    *first, last = (names[place] for place in places)
    return f"{', '.join(first)} and {last}" if first else last


def _better_ones(names: Sequence[str], betters: Sequence[int], before: Sequence[int]) -> str:
    if 1 < len(betters) == len(before) < len(_ALL):
        return _ALL[len(betters)]
    return _join_names(names, betters)
