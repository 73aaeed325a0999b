"""Difficulty strata of instructions, and the split of a set's tasks.

In: what is known of each task. Out: its stratum, its split. The size of a task is the number of
statements that its intent makes, or of objects that its reference changes, whichever is more.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from numpy.random import Generator

from augment.benchmark.values import Split, Stratum
from augment.scene.entities import Modification
from augment.scene.intent import Intent
from augment.scene.intent_statements import list_statements

MEDIUM_FROM = 5
HARD_FROM = 8
"""Sizes; they part the project's own 112 scenarios into 29, 47 and 36."""


def measure_task(intent: Intent | None, reference: Modification | None) -> int | None:
    """Return the size of a task; None where its wish can't be met, medium where nobody knows."""
    if (intent is not None and intent.unmet) or (reference is not None and reference.is_empty):
        return None
    if intent is None and reference is None:
        return MEDIUM_FROM
    objects = 0 if reference is None else len(reference.changed) + len(reference.removed)
    return max(objects, 0 if intent is None else len(list_statements(intent)))


def choose_strata(sizes: Mapping[str, int | None]) -> dict[str, Stratum]:
    """Return the stratum of each task by its size, see `measure_task`.

    Whose wish can't be met is hard. So that this does not tell, at least as many others are hard
    as well: the largest, where too few are anyway.
    """
    feasible = {name: size for name, size in sizes.items() if size is not None}
    by_size = sorted(feasible, key=lambda name: (-feasible[name], name))
    lifted = set(by_size[: len(sizes) - len(feasible)])
    return {
        name: Stratum.HARD if size is None or name in lifted else _stratum(size)
        for name, size in sizes.items()
    }


def _stratum(size: int) -> Stratum:
    if size < MEDIUM_FROM:
        return Stratum.EASY
    return Stratum.MEDIUM if size < HARD_FROM else Stratum.HARD


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitCandidate:
    """A task that gets a split.

    Attributes:
        stratum, type: In each pair of the two the same share is for practice.
        shared: Keys of what it may have in common with other tasks: tasks that share a key are in
            one split, also by way of a third.
        has_reference: Whether it can be for practice at all.
        earlier: Its split in other benchmarks, which it keeps: the test where they differ.
    """

    name: str
    stratum: Stratum
    type: str
    shared: Collection[str] = ()
    has_reference: bool = True
    earlier: Split | None = None


def split_tasks(
    tasks: Sequence[SplitCandidate], *, share: float, rng: Generator
) -> dict[str, Split]:
    """Return the split of each task; a group of tasks is counted where its first task belongs.

    Args:
        tasks: Names are unique.
        share: Of all tasks for practice, from 0 to 1; met as closely as the groups allow.
        rng: Decides which.
    """
    cells: dict[tuple[str, str], list[list[SplitCandidate]]] = {}
    for group in _group_alike(tasks):
        cells.setdefault((group[0].stratum, group[0].type), []).append(group)
    names = sorted(cells)
    splits: dict[str, Split] = {}
    seen = practice = 0
    for place in rng.permutation(len(names)):
        groups = cells[names[place]]
        for number in rng.permutation(len(groups)):
            group = groups[number]
            seen += len(group)
            is_due = practice + len(group) / 2 <= share * seen
            if earlier := {task.earlier for task in group} - {None}:
                is_due = Split.TEST not in earlier
            is_practice = is_due and all(task.has_reference for task in group)
            practice += len(group) * is_practice
            chosen = Split.PRACTICE if is_practice else Split.TEST
            splits |= {task.name: chosen for task in group}
    return splits


def _group_alike(tasks: Sequence[SplitCandidate]) -> list[list[SplitCandidate]]:
    """Return the tasks in groups that share keys, in the order of their first tasks."""
    groups: list[tuple[set[str], list[SplitCandidate]]] = []
    for task in tasks:
        keys = set(task.shared)
        alike = [group for group in groups if group[0] & keys]
        if not alike:
            groups.append((keys, [task]))
            continue
        first = alike[0]
        for other in alike[1:]:
            groups.remove(other)
            first[0].update(other[0])
            first[1].extend(other[1])
        first[0].update(keys)
        first[1].append(task)
    return [members for _, members in groups]
