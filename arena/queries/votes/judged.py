"""Votes as a rating reads them, and who competes.

Votes of a study and votes of a file look alike from here on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC
from typing import NamedTuple

from django.db.models import Max, Q

from arena.models import ImportedVote, Person, Study, Vote
from arena.pairing.order import MAIN
from arena.pairing.rules import Entry, draw_ties, grid_of, scenario_of
from augment.models import Contestant

AUTOMATIC = "automatic"
"""A kind beside those of matchups: a tie on a pair that nobody can tell apart nor was shown."""

RATED = (Vote.Outcome.LEFT.value, Vote.Outcome.EQUAL.value, Vote.Outcome.RIGHT.value)
"""Outcomes that say something; a skip does not."""

IMPORTED = "imported"
"""The kind of a contestant that is known by its name alone."""


class Judged(NamedTuple):
    """One current vote.

    Attributes:
        judge: A lasting code, and `judge_name` the pseudonym.
        item: The scenario's slug, and `type` its type.
        left, right: Slugs of contestants.
        outcome: left, equal or right.
        matchup: Its row, and `repeat_of` the row of the matchup that it shows again.
        at: When it was given, in UTC as ISO 8601; empty where nobody knows, as in all below.
        position: Of the matchup in the expert's own order, from 1.
        aids: What the expert looked with, joined by blanks.
        left_code, right_code: The augmentations that were shown.
    """

    judge: str
    judge_name: str
    item: str
    type: str
    kind: str
    left: str
    right: str
    outcome: str
    both_miss: bool
    is_simulated: bool
    ms_visible: int | None
    matchup: int | None
    repeat_of: int | None
    at: str = ""
    position: int | None = None
    aids: str = ""
    comment: str = ""
    left_code: str = ""
    right_code: str = ""

    @property
    def winner(self) -> str | None:
        """The slug of who won, None without a winner."""
        sides = {Vote.Outcome.LEFT.value: self.left, Vote.Outcome.RIGHT.value: self.right}
        return sides.get(self.outcome)


@dataclass(frozen=True, slots=True, kw_only=True)
class Entrant:
    """Who competes; `contestant` is None for names from a file."""

    slug: str
    name: str
    variant: str
    kind: str
    is_simulated: bool
    contestant: Contestant | None


def is_imported(study: Study) -> bool:
    """Whether the votes came from a file."""
    return hasattr(study, "vote_file")


def last_vote_of(study: Study) -> int | None:
    """The row of the newest vote, so that later ones can be told apart."""
    votes = (
        ImportedVote.objects.filter(file__study=study)
        if is_imported(study)
        else Vote.objects.filter(matchup__study=study)
    )
    found: int | None = votes.aggregate(last=Max("pk"))["last"]
    return found


def votes_up_to(study: Study, last: int | None) -> tuple[list[Judged], int]:
    """The votes that were current at a row, oldest first, and how many were superseded by then.

    Args:
        study: A study of matchups, or one of votes from elsewhere.
        last: See `last_vote_of`; None for none at all.
    """
    if is_imported(study):
        return _imported(study, last), 0
    current = _voted(study, last)
    everything = Vote.objects.filter(matchup__study=study, pk__lte=last or 0).count()
    return current, everything - len(current)


def entrants_of(study: Study, votes: Iterable[Judged]) -> tuple[Entrant, ...]:
    """Who competes, by slug: a study's contestants, or who occurs in the votes of a file."""
    return _names(votes) if is_imported(study) else _contestants(study)


def settled_ties(study: Study, lines: Iterable[Judged]) -> list[Judged]:
    """Ties on the pairs that the study settled without showing; see arena.pairing.rules.

    Args:
        study: A study; one of votes from elsewhere has no such pairs.
        lines: Its votes, which say how often a pair is judged, and by whom.
    """
    settled = [(place, one, other) for place, one, other in study.rules.get("identical", ())]
    if not settled:
        return []
    by_judge: dict[str, list[Judged]] = {}
    for line in lines:
        if line.kind == MAIN and line.outcome in RATED:
            by_judge.setdefault(line.judge, []).append(line)
    types = dict(study.scenarios.values_list("slug", "type"))
    drawn = draw_ties(
        settled,
        {judge: len(own) for judge, own in by_judge.items()},
        showable=_count_showable(study),
        seed=study.seed,
    )
    return [
        Judged(
            judge=judge, judge_name=by_judge[judge][0].judge_name, item=scenario_of(place),
            type=types[scenario_of(place)], kind=AUTOMATIC, left=left, right=right,
            outcome=Vote.Outcome.EQUAL.value, both_miss=False,
            is_simulated=by_judge[judge][0].is_simulated, ms_visible=None, matchup=None,
            repeat_of=None,
        )
        for (place, left, right), judge in drawn
    ]  # fmt: skip


def _count_showable(study: Study) -> int:
    """How many pairs of pictures the planner may show."""
    entries = tuple(Entry(**entry) for entry in study.rules["entries"])
    alike = tuple((place, one, other) for place, one, other in study.rules.get("alike", ()))
    return int(grid_of(entries, alike).showable.sum())


def references() -> frozenset[str]:
    """The slugs of the references, which win attention checks."""
    rows = Contestant.objects.filter(kind=Contestant.Kind.REFERENCE)
    return frozenset(rows.values_list("slug", flat=True))


# --- Votes of a study --------------------------------------------------------------------------


def _contestants(study: Study) -> tuple[Entrant, ...]:
    return tuple(
        Entrant(
            slug=row.slug,
            name=row.name,
            variant=row.variant,
            kind=row.kind,
            is_simulated=row.is_simulated,
            contestant=row,
        )
        for row in study.contestants.order_by("slug")
    )


def _voted(study: Study, last: int | None) -> list[Judged]:
    """Four queries, whatever the number of votes."""
    slugs = dict(Contestant.objects.values_list("pk", "slug"))
    places = {
        pk: (slug, kind) for pk, slug, kind in study.scenarios.values_list("pk", "slug", "type")
    }
    people = {
        user: (str(code), name)
        for user, code, name in Person.objects.values_list("user", "code", "pseudonym")
    }
    current = Q(superseded_by=None) | Q(superseded_by__pk__gt=last or 0)
    rows = (
        Vote.objects.filter(current, matchup__study=study, pk__lte=last or 0)
        .order_by("pk")
        .values_list(
            "expert", "matchup__scenario", "matchup__kind", "shown_left__contestant",
            "shown_right__contestant", "outcome", "both_miss", "is_simulated", "ms_visible",
            "matchup", "matchup__repeat_of", "at", "matchup__position", "aids", "comment",
            "shown_left__code", "shown_right__code",
        )
    )  # fmt: skip
    return [
        Judged(
            *people[expert], *places[place], kind, slugs[left], slugs[right],
            outcome, both_miss, simulated, ms, matchup, repeat_of,
            at.astimezone(UTC).isoformat(timespec="milliseconds"), position, aids, comment,
            str(left_code), str(right_code),
        )
        for (
            expert, place, kind, left, right, outcome, both_miss, simulated, ms, matchup,
            repeat_of, at, position, aids, comment, left_code, right_code
        ) in rows.iterator(chunk_size=5000)
    ]  # fmt: skip


# --- Votes of a file ---------------------------------------------------------------------------

_OUTCOMES = {
    ImportedVote.Outcome.FIRST.value: Vote.Outcome.LEFT.value,
    ImportedVote.Outcome.SECOND.value: Vote.Outcome.RIGHT.value,
    ImportedVote.Outcome.TIE.value: Vote.Outcome.EQUAL.value,
    ImportedVote.Outcome.BOTH_BAD.value: Vote.Outcome.EQUAL.value,
}


def _imported(study: Study, last: int | None) -> list[Judged]:
    rows = (
        ImportedVote.objects.filter(file__study=study, pk__lte=last or 0)
        .order_by("line")
        .values_list("first", "second", "outcome", "judge", "item")
    )
    return [
        Judged(
            judge=judge, judge_name=judge, item=item, type="", kind=MAIN, left=first, right=second,
            outcome=_OUTCOMES[outcome], both_miss=outcome == ImportedVote.Outcome.BOTH_BAD.value,
            is_simulated=study.allow_simulated, ms_visible=None, matchup=None, repeat_of=None,
        )
        for first, second, outcome, judge, item in rows.iterator(chunk_size=5000)
    ]  # fmt: skip


def _names(lines: Iterable[Judged]) -> tuple[Entrant, ...]:
    found = sorted({name for line in lines for name in (line.left, line.right)})
    return tuple(
        Entrant(
            slug=name, name=name, variant="", kind=IMPORTED, is_simulated=False, contestant=None
        )
        for name in found
    )
