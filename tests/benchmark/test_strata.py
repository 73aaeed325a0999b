"""How much an instruction asks for, and which tasks are for practice."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from augment.benchmark.strata import SplitCandidate, choose_strata, measure_task, split_tasks
from augment.benchmark.values import Split, Stratum
from augment.scene.entities import Modification
from augment.scene.intent import Intent, Shape
from augment.scene.intent_statements import list_statements
from tests.intents import cones
from tests.scenes import vehicle

EASY, MEDIUM, HARD = Stratum


def test_a_task_is_as_large_as_what_its_intent_says_or_its_reference_changes() -> None:
    intent = cones(20.0, 3, Shape.LINE)
    two = Modification(added=(vehicle("Agent2", 9.0, 0.0),), removed=("Agent3",))
    six = Modification(removed=tuple(f"Agent{n}" for n in range(2, 8)))
    assert len(list_statements(intent)) == 4
    assert [measure_task(intent, None), measure_task(intent, two)] == [4, 4]
    assert [measure_task(intent, six), measure_task(None, two)] == [6, 2]
    assert measure_task(Intent(unmet="no such lane"), None) is None
    assert measure_task(None, Modification()) is None
    unknown = measure_task(None, None)
    assert choose_strata({"a": unknown}) == {"a": MEDIUM}


def test_limits_of_the_strata() -> None:
    found = choose_strata({str(size): size for size in (1, 4, 5, 7, 8, 30)})
    assert found == {"1": EASY, "4": EASY, "5": MEDIUM, "7": MEDIUM, "8": HARD, "30": HARD}


def test_a_wish_that_cannot_be_met_is_never_alone_among_the_hard_ones() -> None:
    found = choose_strata({"unmet": None, "no way": None, "a": 2, "b": 6, "c": 7})
    assert found == {"unmet": HARD, "no way": HARD, "a": EASY, "b": HARD, "c": HARD}


def candidates(number: int) -> list[SplitCandidate]:
    """Tasks of three strata and two types; each third one says the one before in other words."""
    return [
        SplitCandidate(
            name=f"t{n}",
            stratum=list(Stratum)[n // 3 % 3],
            type=f"type{n // 9 % 2}",
            shared=[f"original {n - 1 if n % 3 == 2 else n}"],
        )
        for n in range(number)
    ]


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.9])
def test_each_stratum_and_type_gives_its_share(share: float) -> None:
    tasks = candidates(360)
    splits = split_tasks(tasks, share=share, rng=np.random.default_rng(3))
    practice = Counter(
        (task.stratum, task.type) for task in tasks if splits[task.name] is Split.PRACTICE
    )
    for stratum in Stratum:
        for kind in ("type0", "type1"):
            assert abs(practice[stratum, kind] - share * 60) <= 2
    assert abs(practice.total() - share * 360) <= 1
    again = split_tasks(tasks, share=share, rng=np.random.default_rng(3))
    assert again == splits


@pytest.mark.parametrize("seed", range(20))
def test_what_is_alike_stays_together_also_by_way_of_a_third(seed: int) -> None:
    tasks = [
        *candidates(60),
        SplitCandidate(name="bridge", stratum=EASY, type="x", shared=["original 0", "original 7"]),
        SplitCandidate(name="loose", stratum=EASY, type="x", shared=["z"], has_reference=False),
    ]
    splits = split_tasks(tasks, share=0.4, rng=np.random.default_rng(seed))
    assert splits.keys() == {task.name for task in tasks}
    assert all(splits[f"t{n}"] is splits[f"t{n + 1}"] for n in range(1, 60, 3))
    assert splits["t0"] is splits["bridge"] is splits["t7"] is splits["t8"]
    assert splits["loose"] is Split.TEST


@pytest.mark.parametrize("seed", range(5))
def test_a_split_is_kept_in_later_benchmarks_and_the_test_wins(seed: int) -> None:
    first = split_tasks(candidates(60), share=0.4, rng=np.random.default_rng(1))
    later = [replace(task, earlier=first.get(task.name)) for task in candidates(63)]
    splits = split_tasks(later, share=0.1, rng=np.random.default_rng(seed))
    assert {name: splits[name] for name in first} == first
    pair = [
        SplitCandidate(name=name, stratum=EASY, type="x", shared=["z"], earlier=Split(name))
        for name in ("practice", "test")
    ]
    assert set(split_tasks(pair, share=0.9, rng=np.random.default_rng(seed)).values()) == {
        Split.TEST
    }
