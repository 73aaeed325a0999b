"""Ratings in words and in the paper's form."""

from __future__ import annotations

from django import template

from arena.models import Snapshot, Standing

register = template.Library()

_METHODS = {
    "bt": "Elo here is a Bradley-Terry model fitted to all votes at once, on the Elo scale; "
    "a tie counts as half a win for both.",
    "elo": "Elo is updated vote by vote; the number shown is the median over resampled orders, "
    "and a tie counts as half a win for both.",
}


@register.filter
def interval(line: Standing) -> str:
    """The interval as distances from the rating, -a / +b; a dash where there is none."""
    if line.rating is None or line.lower is None or line.upper is None:
        return "–"
    return f"−{line.rating - line.lower:.0f} / +{line.upper - line.rating:.0f}"


@register.filter
def method_words(snapshot: Snapshot) -> str:
    """What a method does, in a sentence."""
    return _METHODS[snapshot.method]
