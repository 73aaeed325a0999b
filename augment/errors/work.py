"""What stops work that has begun or waits: the queue, a lease, a key, a lock, a cap."""

from __future__ import annotations

from augment.errors import AugmentError, ModelFault


class QueueFault(AugmentError):
    """No message can be sent. The rows wait and are sent by a worker as soon as it can."""


class QueueRefused(QueueFault):
    """There is a broker and it takes no messages: its memory is full, it is read only.

    Args:
        address: Where it is, free of passwords.
        said: What it answered.
    """

    def __init__(self, address: str, said: str) -> None:
        self.address = address
        self.said = said
        super().__init__(
            f"Redis at {address} takes no messages: {said.rstrip('.')}. What was queued is "
            "kept and runs as soon as Redis takes messages again."
        )


class QueueUnreachable(QueueFault):
    """No broker takes messages. The rows wait and are sent by the next worker that starts.

    Args:
        address: Where a broker was looked for, free of passwords.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        super().__init__(
            f"No Redis at {address}: start `manage.py serve` or set REDIS_URL. What was "
            "queued is kept and runs as soon as a worker starts."
        )


class Unwanted(AugmentError):
    """Nobody needs the answer of a call any more. Ask nothing further; give up what is asked."""


class WorkerStopping(Unwanted):
    """This worker was told to stop and asks nobody any more. The row goes back to the queue."""


class LeaseLost(Unwanted):
    """Somebody else works on this row now. Drop the result; the new holder brings its own."""

    def __init__(self) -> None:
        super().__init__("the row was taken back")


class JobCancelled(Unwanted):
    """The job was cancelled while one of its rows was worked on. The row is cancelled with it."""

    def __init__(self) -> None:
        super().__init__("The job was cancelled.")


class Abandoned(ModelFault):
    """A call in flight was given up, because nobody needs its answer; it may be billed.

    Args:
        why: Who does not need it.
    """

    def __init__(self, why: Unwanted) -> None:
        self.why = why
        super().__init__(f"given up before there was an answer: {why}", retryable=False)


class KeyMissing(AugmentError):
    """The environment variable that should hold an endpoint's key is not set. Set and retry.

    Args:
        variable: The name of the variable; its value is never part of any text.
        endpoint: The label of the endpoint that needs it.
    """

    def __init__(self, variable: str, endpoint: str) -> None:
        self.variable = variable
        self.endpoint = endpoint
        super().__init__(
            f"The environment variable {variable}, which holds the key of endpoint "
            f"{endpoint!r}, is not set where the worker runs."
        )


class KeyNotAllowed(AugmentError):
    """An endpoint names an environment variable that is not meant for keys. Nothing was read.

    Args:
        variable: Its name.
        endpoint: The label of the endpoint that names it.
        rule: Which may be named.
    """

    def __init__(self, variable: str, endpoint: str, rule: str) -> None:
        self.variable = variable
        self.endpoint = endpoint
        super().__init__(
            f"Endpoint {endpoint!r} names the environment variable {variable}, which may not be "
            f"sent to an endpoint: {rule} is needed."
        )


class DatabaseLocked(AugmentError):
    """The database took nothing for longer than anybody waits. Try again when it is less busy.

    Args:
        what: What could not be stored or read.
    """

    def __init__(self, what: str) -> None:
        super().__init__(f"The database was locked for too long: {what}.")


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
