"""Every error of arena says what its reader should do; it carries data and knows no HTTP."""

from augment.errors import AugmentError


class ArenaError(AugmentError):
    """The root of arena's own errors: its text is a sentence for the person who caused it."""


class NotYours(ArenaError):
    """The row belongs to somebody else; whoever asks learns no more than that it is not theirs."""


class StudyNotOpen(ArenaError):
    """The study does not take votes: it is closed or was cancelled."""


class LabellingClosed(ArenaError):
    """The labelling takes no labels any more."""


class AlreadyDecided(ArenaError):
    """The matchup has a vote and the new one does not say that it supersedes it.

    Args:
        outcome: The stored outcome.
    """

    def __init__(self, outcome: str) -> None:
        self.outcome = outcome
        super().__init__(f"This matchup is decided already: {outcome}.")


class EnrolmentOver(ArenaError):
    """The enrolment link takes nobody on: closed, or every place is taken."""


class TooFast(ArenaError):
    """More votes came from one account than a person can give; send this one again later.

    Args:
        retry_after_s: Seconds until it would be taken.
    """

    def __init__(self, retry_after_s: int) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(f"That was too fast. Try again in {retry_after_s} s.")


class DatabaseBusy(ArenaError):
    """The database is locked or its disk is full. Nothing was written; send it again later."""

    retry_after_s = 2
    sentence = "The database can't be written just now: it is busy, or its disk is full."


class StillUnderWay(ArenaError):
    """The same request came before and is not answered yet; nothing was done for this one."""

    retry_after_s = 2
    sentence = "The same request came before and is not answered yet."


class BeingDrawn(ArenaError):
    """Workers still draw the pictures of the pairs that come next."""

    retry_after_s = 2
    sentence = "The next pictures are being drawn. Ask again in a moment."


class KeyReused(ArenaError):
    """The key of a request was used for another one; nothing was done."""

    sentence = "This Idempotency-Key came with another request before: send a new one."


class InvalidVote(ArenaError):
    """Parts of a vote or report do not go together.

    Args:
        fields: By field, a sentence on what is wrong with it.
    """

    def __init__(self, fields: dict[str, str]) -> None:
        self.fields = fields
        super().__init__(" ".join(fields.values()))


class NothingToPlan(ArenaError):
    """The rules of a study can't be met with the augmentations that exist; the text says why."""


class StudyStillOpen(ArenaError):
    """Results of an open study are not shown by accident; looking early is a logged act.

    Args:
        name: The study.
    """

    def __init__(self, name: str) -> None:
        super().__init__(
            f"The study '{name}' is still open. Close it first, or look early on purpose: "
            "that is written to the log."
        )


class VotesUnreadable(ArenaError):
    """A file of votes is not what it should be; the text has the line and what is allowed."""


class NoSnapshot(ArenaError):
    """The study has not been rated yet; rate it first."""


class AlreadyLabelled(ArenaError):
    """The expert has labelled this picture otherwise; the first label counts."""


class LinkOver(ArenaError):
    """The invitation lets nobody in: it expired, was taken back or names no expert any more."""


class TokenOver(ArenaError):
    """An API token opens nothing: nobody has it, or it expired or was revoked."""


class TooManyRequests(ArenaError):
    """An API token was used more often than its role may; nothing was done.

    Args:
        most: Requests within the window.
        retry_after_s: Its length: after so many seconds the next one is taken.
    """

    def __init__(self, most: int, retry_after_s: int) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(
            f"More than {most} requests within {retry_after_s} s came with this token. Try "
            f"again in {retry_after_s} s."
        )
