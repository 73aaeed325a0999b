"""Why rows of a job have no modification, grouped by what the reasons have in common.

Reasons name what was at hand: a request's id, a count, a place in an answer. Two that differ in
nothing else have one cause; its key is the same from one look to the next.
"""

from __future__ import annotations

import hashlib
import re
from collections import Counter, defaultdict
from dataclasses import dataclass

from django.db.models.functions import Substr

from augment.errors import UnknownName
from augment.models import Augmentation, GenerationJob
from augment.services.running.progress import cells_of

State = Augmentation.State

GROUPED = (State.FAILED, State.UNREADABLE, State.REFUSED)

LOOKED_AT = 300
"""So many characters of a reason tell its cause."""

EXAMPLES = 12
"""So many rows of a cause are named on a page; the others are in the grid."""

SHOWN = 20
"""So many causes name rows."""

_STATUS = re.compile(r"\b(HTTP \d{3})\b")
_VARYING = re.compile(
    r"\b[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}\b"  # a UUID
    r"|\b(?:[a-z]+[-_])?(?=[0-9a-f]*\d)[0-9a-f]{12,}\b"  # a request's id
    r"|(?<![\w.-])\d+(?:\.\d+)?",  # a number that is no part of a word
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureGroup:
    """Augmentations without a modification that ended for the same cause.

    Attributes:
        key: What names it.
        reason: The reason that most of them have.
        variants: So many different reasons there are.
        augmentations: Some of them, with scenario and contestant.
    """

    key: str
    state: State
    reason: str
    number: int
    variants: int
    augmentations: list[Augmentation]

    @property
    def unnamed(self) -> int:
        """How many more there are than are named."""
        return self.number - len(self.augmentations)


def cause_of(reason: str) -> str:
    """A reason without what differs from row to row; the HTTP status stays."""
    parts = _STATUS.split(reason[:LOOKED_AT])
    varied = [part if number % 2 else _VARYING.sub("#", part) for number, part in enumerate(parts)]
    return " ".join("".join(varied).split())


def failure_groups(job: GenerationJob) -> list[FailureGroup]:
    """What has no modification, by state and cause; machine faults first, then the largest.

    Two queries. Of causes beyond the first SHOWN no rows are named.
    """
    found = _found(job)
    largest = sorted(found, key=lambda one: (one[0] != State.FAILED, -len(found[one]), one[1]))
    named = [pk for one in largest[:SHOWN] for pk, _ in found[one][:EXAMPLES]]
    cells = {cell.pk: cell for cell in cells_of(job).filter(pk__in=named)} if named else {}
    return [_group(state, cause, found[state, cause], cells) for state, cause in largest]


def rows_of_cause(job: GenerationJob, key: str) -> tuple[State, str, list[int]]:
    """The state, the cause and the rows of a group.

    Raises:
        UnknownName: No row of the job has that cause (any more).
    """
    found = _found(job)
    for (state, cause), rows in found.items():
        if key_of(state, cause) == key:
            return state, cause, [pk for pk, _ in rows]
    known = [key_of(state, cause) for state, cause in found]
    raise UnknownName("cause in this job", key, known)


def key_of(state: State, cause: str) -> str:
    """What names a cause in an address."""
    return hashlib.sha256(f"{state.value}\n{cause}".encode()).hexdigest()[:16]


# --- Private -----------------------------------------------------------------------------------


def _found(job: GenerationJob) -> dict[tuple[State, str], list[tuple[int, str]]]:
    """By state and cause the rows with the beginnings of their reasons; one query."""
    rows = job.augmentations.filter(state__in=GROUPED).order_by("pk")
    said = rows.annotate(said=Substr("reason", 1, LOOKED_AT)).values_list("pk", "state", "said")
    causes: dict[str, str] = {}
    found: defaultdict[tuple[State, str], list[tuple[int, str]]] = defaultdict(list)
    for pk, state, reason in said.iterator():
        if reason not in causes:
            causes[reason] = cause_of(reason)
        found[State(state), causes[reason]].append((pk, reason))
    return found


def _group(
    state: State, cause: str, rows: list[tuple[int, str]], cells: dict[int, Augmentation]
) -> FailureGroup:
    said = Counter(reason for _, reason in rows)
    usual = said.most_common(1)[0][0]
    some = [cells[pk] for pk, _ in rows[:EXAMPLES] if pk in cells]
    return FailureGroup(
        key=key_of(state, cause),
        state=state,
        reason=next((one.reason for one in some if one.reason.startswith(usual)), usual),
        number=len(rows),
        variants=len(said),
        augmentations=some,
    )
