"""What is wrong with what somebody gave: a file, a name, a change, a wish."""

from __future__ import annotations


class AugmentError(Exception):
    """The root of augment's own errors: its text is a sentence for the person who caused it."""


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
        super().__init__(f"This {what} can't be read: {shown}{more}")


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
        super().__init__(
            f"Unknown {kind} '{name}'. Known: {', '.join(allowed)}."
            if allowed
            else f"Unknown {kind} '{name}'. Known: none yet."
        )


class Conflict(AugmentError):
    """The request contradicts what is stored already (a taken slug, a finished job)."""


class CannotDrive(AugmentError):
    """A scene or a planner does not allow a drive. Mend what the sentence names."""


class CannotPlace(AugmentError):
    """A contestant without a language model refuses rather than guesses. An outcome, no retry.

    Args:
        reason: What is open that it needs, or why the map or the traffic leaves no room.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(reason)
