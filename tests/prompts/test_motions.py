"""A motion that stands in a prompt's lists is read back from an answer as it was."""

import json
import re
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.prompts.fill import read_text
from augment.prompts.reply import read_reply
from augment.prompts.vectors import (
    changes_text,
    motion_parts,
    scene_text,
    short_names,
    with_short_ids,
)
from augment.scene.entities import Modification, Scene
from augment.scene.planned_motion import (
    EGO_ID,
    AtPlace,
    AtTime,
    LanePath,
    NearEgo,
    PlannedMotion,
    PointPath,
)
from tests.fixtures.shelf import MOVING_SLUGS, entry, shown_scene
from tests.properties import examples
from tests.scenes import junction, vehicle
from tests.variants.playing import block

FOREIGN = {"Lane1": "48", "Connector2": "turn:left", "Lane3": "Agent9"}


def foreign() -> Scene:
    """A junction with ids from elsewhere: a lane and a truck share one, another is like ours."""
    names = replace(short_names(junction()), lanes=FOREIGN, agents={"Agent2": "48"})
    return with_short_ids(replace(junction(), agents=(vehicle("Agent2", 30.0, 4.0),)), names)


def hundredths(low: float, high: float) -> st.SearchStrategy[float]:
    return st.integers(round(low * 100), round(high * 100)).map(lambda number: number / 100)


POINTS = st.tuples(hundredths(-160, 160), hundredths(-160, 160))
PATHS = st.sampled_from([("48",), ("48", "turn:left"), ("turn:left", "Agent9")])
MOTIONS = st.builds(
    PlannedMotion,
    path=st.none()
    | st.builds(LanePath, lane_ids=PATHS, change_m=hundredths(1, 200))
    | st.builds(
        PointPath,
        points_m=st.lists(POINTS, min_size=1, max_size=5).map(tuple),
        keeps_heading=st.booleans(),
    ),
    speeds=st.lists(
        st.tuples(hundredths(0, 60), hundredths(0, 100)), max_size=5, unique_by=lambda row: row[0]
    ).map(lambda rows: tuple(sorted(rows))),
    start=st.builds(AtTime, after_s=hundredths(0, 60))
    | st.builds(NearEgo, within_m=hundredths(0.01, 500))
    | st.builds(
        AtPlace,
        agent_id=st.sampled_from(["Agent1", "48"]),
        x_m=hundredths(-99, 99),
        y_m=hundredths(-99, 99),
        within_m=hundredths(0.01, 500),
    ),
)


def vector(text: str, name: str) -> list[Any]:
    """An agent's entry in a list."""
    (line,) = [one for one in text.splitlines() if f'"{name}": [' in one]
    written = line[line.index(f'"{name}": ') + len(name) + 4 :]
    values: list[Any] = json.JSONDecoder().raw_decode(written)[0]
    return values


def entry_of(name: str, values: list[Any]) -> dict[str, object]:
    """The same as a model answers it."""
    keys = (
        *("type", "x_m", "y_m", "heading_rad", "width_m", "length_m"),
        *("speed_mps", "lane", "motion"),
    )
    return {"id": name, **dict(zip(keys, values, strict=False))}


@examples(40)
@given(motion=MOTIONS)
def test_every_motion_that_is_shown_is_read_back(motion: PlannedMotion) -> None:
    street = foreign()
    added = vehicle("Agent3", 5.0, 0.0, lane_id="48", motion=motion)
    moved = replace(street.agents[0], motion=motion)
    if isinstance(motion.start, AtPlace):
        start = replace(motion.start, agent_id=EGO_ID)
        moved = replace(moved, motion=replace(motion, start=start))
    change = Modification(added=(added,), moved=(moved,))
    told = changes_text(street, change)
    assert "turn:left" not in told
    written = [entry_of(name, vector(told, name)) for name in ("Agent3", "Agent2")]
    answer = block(written[0], move=[written[1]])
    read = read_reply(answer, street).modification
    assert (read.added[0].motion, read.added[0].lane_id) == (added.motion, "48")
    assert (read.moved[0].id, read.moved[0].motion) == ("48", moved.motion)
    in_scene = scene_text(replace(street, agents=(moved,)))
    assert vector(in_scene, "Agent2") == vector(told, "Agent2")


@pytest.mark.parametrize("slug", MOVING_SLUGS)
def test_every_reference_of_the_moving_set_can_be_answered(slug: str) -> None:
    street, right = shown_scene(slug), entry(slug).reference
    shown, told = with_short_ids(right, short_names(street)), changes_text(street, right)
    added, moved = (
        [entry_of(agent.id, vector(told, agent.id)) for agent in agents]
        for agents in (shown.added, shown.moved)
    )
    read = read_reply(block(*added, move=moved), street).modification
    assert [agent.id for agent in read.changed] == [agent.id for agent in right.changed]
    for agent, meant in zip(read.changed, right.changed, strict=True):
        assert (agent.motion is None) == (meant.motion is None)
        if agent.motion is not None and meant.motion is not None:
            assert motion_parts(agent.motion) == motion_parts(meant.motion)


def test_whoever_copies_the_example_motions_has_values_that_no_scenario_has() -> None:
    rule = read_text("rules.md")
    single = set(map(float, re.findall(r'"(?:after_s|within_m|change_m)":([\d.]+)', rule)))
    pairs = {tuple(map(float, one)) for one in re.findall(r"\[\[([\d.]+),([\d.]+)\]\]", rule)}
    assert (len(single), len(pairs)) == (4, 3)
    for slug in MOVING_SLUGS:
        for motion in filter(None, (one.motion for one in entry(slug).reference.changed)):
            names = ("after_s", "within_m", "change_m")
            used = {
                getattr(one, name, None) for one in (motion.start, motion.path) for name in names
            }
            assert not used & single
            assert not pairs & set(motion.speeds)
