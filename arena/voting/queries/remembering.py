"""Counts that a process keeps as long as nothing they were counted from has changed.

Votes are append-only and a plan only grows, so how many there are and the newest of them say
whether something is new: a vote that commits late, with a smaller number, changes the first.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

from django.db.models import Count, Max

from arena.models import Matchup, Study, Vote

Kept = TypeVar("Kept")


class Remembered(Generic[Kept]):
    """The last few values by what they were made from; nothing in them may be changed.

    Args:
        most: How many are kept; the one that was not asked for the longest goes first.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._kept: OrderedDict[Hashable, Kept] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, make: Callable[[], Kept]) -> Kept:
        """What is kept under the key; made where there is none. Two threads may both make it."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        made = make()
        with self._lock:
            self._kept[key] = made
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        return made


def plan_of(study: Study) -> Hashable:
    """Another value whenever a matchup came in; one query."""
    return (study.code, _newest(Matchup))


def _newest(rows: type[Vote] | type[Matchup]) -> Hashable:
    found = rows.objects.aggregate(number=Count("pk"), last=Max("pk"))
    return (found["number"], found["last"])
