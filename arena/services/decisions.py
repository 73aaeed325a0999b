"""What an expert may decide about a pair, read from what came in."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from uuid import UUID

from arena.errors import InvalidVote
from arena.models import AIDS, Vote
from augment.services.texts import make_storable

LONGEST_COMMENT = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What an expert decided, as it came in; its parts go together."""

    key: UUID
    matchup: UUID
    outcome: Vote.Outcome
    both_miss: bool
    reason: str
    comment: str
    aids: str
    supersedes: UUID | None
    ms_visible: int | None


def decision_of(
    *,
    matchup_code: UUID | str,
    key: UUID | str,
    outcome: str,
    both_miss: bool = False,
    reason: str = "",
    comment: str = "",
    aids: Iterable[str] = (),
    supersedes: UUID | str | None = None,
    ms_visible: int | None = None,
) -> Decision:
    """Read what came in.

    Args:
        matchup_code: What was decided; one of the expert's own matchups.
        key: Made by the browser, one per decision.
        outcome: "left", "equal", "right" or "skip"; the side is kept apart from who won.
        both_miss: With "equal": both miss the instruction. Counts as a tie.
        reason: With "skip": why, one of Vote.SkipReason.
        comment: Whatever the expert wants to add.
        aids: What was used to look, out of AIDS.
        supersedes: The key of the matchup's current vote, to change it.
        ms_visible: How long the pair was on screen.

    Raises:
        ValueError: The outcome is none of the four.
        InvalidVote: Parts do not go together, or are unknown.
    """
    chosen = Vote.Outcome(outcome)
    _check_parts(chosen, both_miss, reason, comment, used := set(aids))
    return Decision(
        key=_uuid(key),
        matchup=_uuid(matchup_code),
        outcome=chosen,
        both_miss=both_miss,
        reason=reason,
        comment=make_storable(comment.strip()),
        aids=" ".join(aid for aid in AIDS if aid in used),
        supersedes=None if supersedes is None else _uuid(supersedes),
        ms_visible=ms_visible,
    )


def _check_parts(
    outcome: Vote.Outcome, both_miss: bool, reason: str, comment: str, aids: set[str]
) -> None:
    wrong = {}
    if both_miss and outcome != Vote.Outcome.EQUAL:
        wrong["both_miss"] = "Both can only miss the instruction where they are equal."
    if outcome == Vote.Outcome.SKIP and reason not in Vote.SkipReason.values:
        wrong["reason"] = f"A skip needs one of: {', '.join(Vote.SkipReason.values)}."
    if outcome != Vote.Outcome.SKIP and reason:
        wrong["reason"] = "Only a skip has a reason."
    if len(comment) > LONGEST_COMMENT:
        wrong["comment"] = f"A comment has at most {LONGEST_COMMENT} characters."
    if unknown := sorted(aids - set(AIDS)):
        wrong["aids"] = f"Unknown: {', '.join(unknown)}. Known: {', '.join(AIDS)}."
    if wrong:
        raise InvalidVote(wrong)


def _uuid(value: UUID | str) -> UUID:
    return value if isinstance(value, UUID) else UUID(value)
