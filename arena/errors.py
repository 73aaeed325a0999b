"""Every error of arena says what its reader should do; it carries data and knows no HTTP."""

from __future__ import annotations


class ArenaError(Exception):
    """The root of arena's own errors: its text is a sentence for the person who caused it."""


class NotYours(ArenaError):
    """The row belongs to somebody else; whoever asks learns no more than that it is not theirs."""


class StudyNotOpen(ArenaError):
    """The study does not take votes: it is a draft or closed."""


class AlreadyDecided(ArenaError):
    """The matchup has a vote and the new one does not say that it supersedes it.

    Args:
        outcome: The stored outcome.
    """

    def __init__(self, outcome: str) -> None:
        self.outcome = outcome
        super().__init__(f"This matchup is decided already: {outcome}.")


class NothingToPlan(ArenaError):
    """The rules of a study can't be met with the augmentations that exist; the text says why."""


class NotRateable(ArenaError):
    """The votes do not determine a rating; the text says why."""


class StudyStillOpen(ArenaError):
    """Results of an open study are not shown by accident; looking early is a logged act.

    Args:
        name: The study.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        super().__init__(
            f"The study {name!r} is still open. Close it first, or look early on purpose: that "
            "is written to the log."
        )


class NoSnapshot(ArenaError):
    """The study has not been rated yet; rate it first."""


class AlreadyLabelled(ArenaError):
    """The expert has labelled this picture otherwise; the first label counts."""
