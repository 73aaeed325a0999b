"""Statements of a rating on pairs that nobody can tell apart."""

from arena.models import Study, Vote
from arena.pairing.order import MAIN
from arena.pairing.rules import scenario_at
from arena.rating.lines import whole_percent
from arena.results.queries.votes import AUTOMATIC, VoteSet


def remark_on_ties(study: Study, votes: VoteSet, *, left_out: bool) -> str:
    """Return the table's estimand if pairs are counted as ties unshown, else an empty text.

    Args:
        study: What was planned.
        votes: That count.
        left_out: Whether settled pairs are left out.
    """
    settled = len(study.rules.get("identical", ()))
    if not settled:
        return ""
    ties = sum(vote.kind == AUTOMATIC for vote in votes.counted)
    sentence = (
        f"The table says how contestants compare where their pictures differ: {settled} pairs "
        "that nobody can tell apart were not shown and are left out."
        if left_out
        else f"The table says how contestants compare over all pairs of pictures: {settled} "
        f"pairs that nobody can tell apart were not shown and count as {ties} ties, as many a "
        "pair as others have votes on average."
    )
    return f"{sentence} {_on_those_shown(study, votes)}".strip()


def _on_those_shown(study: Study, votes: VoteSet) -> str:
    """The tie share of alike pairs that experts were shown all the same."""
    shown = {
        (scenario_at(place), frozenset((first, other)))
        for place, first, other in study.rules.get("alike_shown", ())
    }
    votes_shown = [
        vote.outcome == Vote.Outcome.EQUAL
        for vote in votes.counted
        if vote.kind == MAIN and (vote.item, frozenset((vote.left, vote.right))) in shown
    ]
    if not votes_shown:
        return ""
    return (
        f"Of {len(votes_shown)} votes on {len(shown)} such pairs that were shown all the same, "
        f"{sum(votes_shown)} are ties ({whole_percent(sum(votes_shown) / len(votes_shown))} %)."
    )
