"""Every error of augment says what its reader should do; it carries data and knows no HTTP."""

from collections.abc import Iterable


class AugmentError(Exception):
    """The root of augment's own errors: its text is a sentence for the person who caused it.

    Attributes:
        sentence: The text of one that is raised without any.
    """

    sentence = ""

    def __init__(self, *texts: object) -> None:
        super().__init__(*(texts or [self.sentence]))


# --- What is wrong with an input ---------------------------------------------------------------


class InvalidDocument(AugmentError):
    """A file or document breaks its format. Mend the input; nothing of it was kept.

    Args:
        what: The kind of document, such as "scene" or "Argoverse 2 log".
        problems: One entry a fault: the path inside the document and what is allowed there.
    """

    def __init__(self, what: str, problems: list[tuple[str, str]]) -> None:
        self.what = what
        self.problems = problems
        shown = "; ".join(f"{path or '(document)'}: {text}" for path, text in problems[:8])
        more = f" (and {len(problems) - 8} more)" if len(problems) > 8 else ""
        this = "These" if what.endswith("results") else "This"
        super().__init__(f"{this} {what} can't be read: {shown}{more}")


class InvalidModification(AugmentError):
    """A modification does not fit its scene (unknown id, id taken twice). Ask again or mend it."""


class UnknownName(AugmentError):
    """A name that nobody registered; the sentence lists what is allowed.

    Args:
        kind: What was looked up ("contestant", "scenario", "variant").
        name: The value that was given.
        allowed: The names that would have been understood.
    """

    def __init__(self, kind: str, name: str, allowed: list[str]) -> None:
        self.kind = kind
        self.name = name
        self.allowed = allowed
        super().__init__(f"Unknown {kind} '{name}'. Known: {', '.join(allowed) or 'none yet'}.")


def check_names(kind: str, names: Iterable[str], allowed_names: Iterable[str]) -> None:
    """Do nothing where all names are known.

    Raises:
        UnknownName: For the first that is not.
    """
    allowed = list(allowed_names)
    for name in names:
        if name not in allowed:
            raise UnknownName(kind, name, allowed)


class Conflict(AugmentError):
    """The request contradicts what is stored already (a taken slug, a finished job)."""


class CannotDrive(AugmentError):
    """A scene or a planner does not allow a drive. Mend what the sentence names."""


class CannotPlace(AugmentError):
    """A contestant without a language model refuses rather than guesses. An outcome, no retry.

    The text says what is open that it needs, or why the map or the traffic leaves no room.
    """


# --- What goes wrong when a model is asked -----------------------------------------------------


class ReplyUnreadable(AugmentError):
    """A model's answer could not be read. Ask once more with the problems, then give up.

    Args:
        problems: What was wrong, each a sentence that can go back to the model.
    """

    def __init__(self, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("The answer can't be read: " + "; ".join(problems))


class ToolError(AugmentError):
    """A tool was called in a way that has no answer; the model gets the sentence, to try again."""


class ModelFault(AugmentError):
    """The wire or the endpoint broke before there was an answer.

    Args:
        message: What happened, free of keys.
        retryable: Whether the same request may succeed later.
        status: The HTTP status, if there was one.
        retry_after_s: How long the endpoint asked to be left alone.
    """

    def __init__(
        self,
        message: str,
        *,
        retryable: bool = False,
        status: int | None = None,
        retry_after_s: float | None = None,
    ) -> None:
        self.retryable = retryable
        self.status = status
        self.retry_after_s = retry_after_s
        super().__init__(message)


class ParameterRefused(ModelFault):
    """The endpoint does not take one parameter of the request. Send it again without.

    Args:
        parameter: Its name on the wire.
        message: What the endpoint said, free of keys.
        status: The HTTP status.
    """

    def __init__(self, parameter: str, message: str, *, status: int) -> None:
        self.parameter = parameter
        super().__init__(message, retryable=True, status=status)


class NotSent(ModelFault):
    """The request never left this computer: there is nothing to be billed for."""


class EndpointBusy(NotSent):
    """No place was free at the endpoint; nothing was sent. Raise its limits or wait."""


class ContextTruncated(ModelFault):
    """The endpoint silently cut the prompt. Give it a larger window; asking again cuts again."""


class ModelRefused(AugmentError):
    """The model answered that it will not do this. An outcome, never retried."""


class ReviewUnusable(AugmentError):
    """A review could not be had. What was reviewed stands without one.

    Args:
        reason: What failed and how.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"The review is unusable: {reason}")


# --- What stops work that has begun or waits ---------------------------------------------------


class QueueFault(AugmentError):
    """No message can be sent. The rows wait and are sent by a worker as soon as it can."""


class QueueRefused(QueueFault):
    """There is a broker and it takes no messages: its memory is full, it is read only."""


class QueueUnreachable(QueueFault):
    """No broker takes messages. The rows wait and are sent by the next worker that starts."""


class NotNeeded(AugmentError):
    """Nobody needs the answer of a call any more. Ask nothing further; give up what is asked."""


class WorkerStopping(NotNeeded):
    """Shutting down: no more model calls; the row is requeued."""


class LeaseLost(NotNeeded):
    """Another worker has this row now. Drop the result; the new holder brings its own."""

    sentence = "the row was taken back"


class JobCancelled(NotNeeded):
    """The job was cancelled while one of its rows was worked on. The row is cancelled with it."""

    sentence = "The job was cancelled."


class QuestionInFlight(AugmentError):
    """Somebody else has just asked the model the same: wait for that answer."""


class CallDropped(ModelFault):
    """A call in flight was given up, because nobody needs its answer; it may be billed.

    Args:
        why: What ended the need.
    """

    def __init__(self, why: NotNeeded) -> None:
        self.why = why
        super().__init__(f"given up before there was an answer: {why}")


class KeyMissing(AugmentError):
    """The environment variable that should hold an endpoint's key is not set. Set and retry."""


class KeyNotAllowed(AugmentError):
    """An endpoint may not be sent the variable that it names. Nothing was read."""


class DatabaseLocked(AugmentError):
    """The database took nothing for longer than anybody waits. Try again when it is less busy."""


class MediaFault(AugmentError):
    """Pictures can't be kept or read just now. What models answered is kept: mend it and retry.

    The text is the same for every file, so that rows which failed by one cause are retried as one;
    which file it was stands in the log.

    Args:
        deed: What was to be done with the file: read, write, look for, list, delete.
        place: The folder or bucket.
        cause: What the folder or bucket said, in a few words.
    """

    def __init__(self, deed: str, place: str, cause: str) -> None:
        super().__init__(
            f"The storage of pictures failed: could not {deed} a file in {place}: {cause}."
        )


class BudgetSpent(AugmentError):
    """The next call could pass the cap of its job. Stop; raising the cap lets the job go on.

    Args:
        limit: Which cap, as a person reads it: "2.50 USD", "100 calls".
    """

    def __init__(self, limit: str) -> None:
        self.limit = limit
        super().__init__(f"The next call could pass the job's cap of {limit}.")
