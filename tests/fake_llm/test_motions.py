"""The stand-ins asked for motions over the wire, through every kind of recipe."""

import random
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import pytest

from augment.baselines.rule_placer import place
from augment.checks import FindingKind, Ground
from augment.checks.registry import check_against_intent
from augment.fake_llm.careless import MOTION_MISTAKES
from augment.fake_llm.playing import review_problems
from augment.fake_llm.server import FakeServer, running
from augment.fake_llm.sight import Task
from augment.prompts.vectors import changes_text
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.intent import Intent
from augment.variants.pipeline import EditTask, Outcome
from augment.variants.recipes import find_recipe
from tests.checks.test_asked_motions import WISHES
from tests.fixtures.shelf import entry, shown_scene
from tests.variants.playing import MemoryTranscript, play, stand_in_model

OPEN = "way-ferry-road"
KNOWN = WISHES | {OPEN: (shown_scene(OPEN), entry(OPEN).intent or Intent())}


def known(instruction: str) -> list[tuple[Scene, Intent]]:
    return [KNOWN[instruction]] if instruction in KNOWN else []


@pytest.fixture(scope="module")
def server() -> Iterator[FakeServer]:
    with running(known=known) as serving:
        yield serving


def asked(
    server: FakeServer, name: str, variant: str, *, native: bool = False, model: str = "fake-good"
) -> Outcome:
    task = EditTask(scene=KNOWN[name][0], instruction=name)
    with stand_in_model(server, model, native=native) as good:
        return play(find_recipe(variant), task, good, MemoryTranscript())


@pytest.mark.parametrize(
    ("name", "variant", "native"),
    [
        *((name, "otm", False) for name in WISHES),
        *(("cut_in", *how) for how in product(("fc", "fc-plus"), (False, True))),
    ],
)
def test_a_good_stand_in_answers_what_is_asked_of_a_motion(
    server: FakeServer, name: str, variant: str, native: bool
) -> None:
    scene, intent = WISHES[name]
    made = asked(server, name, variant, native=native)
    right = place(scene, intent).modification
    assert apart_m(scene, made.modification, right) < 0.5


def apart_m(scene: Scene, one: Modification, other: Modification) -> float:
    """How far the changed agents of two changes are from each other, at most, over 6 s."""
    ways = [
        [move.states[:60, :2] for move in Ground.of(scene).motion_after(change).others]
        for change in (one, other)
    ]
    return max(float(abs(a - b).max()) for a, b in zip(*ways, strict=True))


@pytest.mark.parametrize("name", WISHES)
def test_a_good_reviewer_accepts_what_is_asked(server: FakeServer, name: str) -> None:
    assert asked(server, name, "tqa").is_accepted


@pytest.mark.parametrize(
    ("model", "misses"), [("fake-good", []), ("fake-careless", [FindingKind.PURPOSE])]
)
def test_an_open_wish_is_served_or_missed_by_what_was_found(
    server: FakeServer, model: str, misses: list[FindingKind]
) -> None:
    scene, intent = KNOWN[OPEN]
    made = asked(server, OPEN, "otm", model=model)
    found = check_against_intent(Ground.of(scene), made.modification, intent)
    assert [one.kind for one in found if one.is_fault] == misses
    assert asked(server, OPEN, "tqa").is_accepted


@pytest.mark.parametrize(
    ("name", "mistake"),
    [
        *(("cut_in", one) for one in MOTION_MISTAKES if one != "wrong-deceleration"),
        *(("door_opening", "late-start"), ("hard_braking", "wrong-deceleration")),
        *(("pull_out", "wrong-speed"), ("late_pedestrian", "wrong-way")),
    ],
)
def test_a_good_reviewer_finds_a_mistake_in_a_motion(name: str, mistake: str) -> None:
    scene, intent = WISHES[name]
    right, route = place(scene, intent).modification, EgoRoute.of(scene)
    (agent,) = right.changed
    bent = replace(
        agent, motion=MOTION_MISTAKES[mistake](agent, agent.motion, route, random.Random(2))
    )
    told = [
        [problem["problem"].split()[0] for problem in review_problems(task(change, scene, intent))]
        for change in (right, with_one(right, bent))
    ]
    assert told == [[], [agent.id]]


def task(change: Modification, scene: Scene, intent: Intent) -> Task:
    return Task(prompt=f"\n{changes_text(scene, change)}", scene=scene, intent=intent)


def with_one(change: Modification, agent: TrafficAgent) -> Modification:
    return replace(change, added=(agent,)) if change.added else replace(change, moved=(agent,))
