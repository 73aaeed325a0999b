"""What was changed is found again: in our JSON, and through the formats of others."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.benchmark.difference import SourceView, find_difference, number_added
from augment.benchmark.submission import identify, show_source
from augment.benchmark.submitted_file import FileContent, read_file
from augment.formats.writers import writer_named
from augment.formats.writing import Cell
from augment.metrics.displacement import are_alike
from augment.scene.entities import AgentType, Modification, Origin, Scene, TrafficAgent, apply
from augment.scene.planned_motion import AtPlace, PlannedMotion, PointPath
from tests.benchmark.sets import KINDS, street, street_set
from tests.properties import examples
from tests.scenes import pose_in_parent, vehicle

(TASK,) = street_set("near").tasks
SUFFIXES = {"commonroad": "near.xml", "scenarionet": "sd_scenario_arena_1_near.pkl"}
DRIVEN = KINDS[:3]
BECOMES = {
    "commonroad": {
        AgentType.TRAFFIC_CONE: AgentType.BARRIER,
        AgentType.CONSTRUCTION_SIGN: AgentType.BARRIER,
    },
    "scenarionet": {
        AgentType.BUS: AgentType.VEHICLE,
        AgentType.CONSTRUCTION_SIGN: AgentType.GENERIC_OBJECT,
    },
}
"""What an added agent of a type comes back as; barriers don't come back from CommonRoad."""


@st.composite
def changes(draw: st.DrawFn) -> Modification:
    """Any part of the street moved or removed, and up to four new ones."""
    far = st.floats(0.5, 8.0) | st.floats(-8.0, -0.5)
    moved, removed = [], []
    for agent in street().agents:
        deed = draw(st.sampled_from(["keep", "keep", "move", "remove"]))
        removed += [agent.id] if deed == "remove" else []
        if deed == "move":
            turned = draw(st.floats(-3.0, 3.0))
            x_m, y_m = agent.x_m + draw(far), agent.y_m + draw(far)
            moved.append(replace(agent, heading_rad=turned, x_m=x_m, y_m=y_m))
    places = draw(st.lists(st.tuples(st.integers(-45, 90), st.integers(8, 30)), max_size=4))
    added = []
    for number, (x, y) in enumerate(dict.fromkeys(places), start=40):
        kind = draw(st.sampled_from(KINDS))
        agent = vehicle(f"Agent{number}", float(x), float(y), draw(st.floats(-3.0, 3.0)))
        speed_mps = draw(st.sampled_from([0.0, 5.0])) if kind in DRIVEN else 0.0
        added.append(replace(agent, type=kind, speed_mps=speed_mps))
    return Modification(added=tuple(added), moved=tuple(moved), removed=tuple(removed))


def through(name: str, change: Modification, folder: Path) -> FileContent:
    """The changed scene, written and read."""
    cell = Cell(name="near", stem="near", scene=street(), type=None, modification=change)
    path = folder / SUFFIXES[name]
    path.write_bytes(writer_named(name)([cell]).files[path.name])
    return read_file(path)


def said(name: str, change: Modification) -> Modification:
    """What a format can say of a change."""
    lost = AgentType.BARRIER if name == "commonroad" else None
    ours = {agent.id: agent for agent in street().agents}
    return Modification(
        added=tuple(
            replace(agent, type=BECOMES[name].get(agent.type, agent.type))
            for agent in change.added
            if agent.type is not lost
        ),
        moved=tuple(agent for agent in change.moved if agent.type is not lost),
        removed=tuple(one for one in change.removed if ours[one].type is not lost),
    )


@given(changes())
def test_our_own_json_gives_the_change_itself(change: Modification) -> None:
    found, notes = find_difference(street(), apply(street(), change))
    assert notes == ()
    assert found == change


@pytest.mark.slow
@pytest.mark.parametrize("name", SUFFIXES)
@examples(20)
@given(change=changes())
def test_a_format_of_others_gives_what_it_can_say(
    name: str, change: Modification, tmp_path_factory: pytest.TempPathFactory
) -> None:
    content = through(name, change, tmp_path_factory.mktemp("there"))
    view = identify(show_source(TASK, name), content)
    found, _ = find_difference(street(), content.scene, view)
    assert are_alike(found, said(name, change)), (found, said(name, change))


def shown(scene: Scene, **view: object) -> SourceView:
    agents = {agent.id: agent for agent in scene.agents}
    return SourceView(**({"agents": agents, "origin": scene.origin} | view))  # type: ignore[arg-type]


def renamed(scene: Scene) -> Scene:
    """As readers name agents: by their distance, whoever they are."""
    near_first = sorted(scene.agents, key=lambda one: math.hypot(one.x_m, one.y_m))
    named = (replace(one, id=f"Agent{n}") for n, one in enumerate(near_first, start=2))
    return replace(scene, agents=tuple(named))


@given(changes())
def test_without_names_who_is_where_he_was_stays_and_new_are_found(change: Modification) -> None:
    """Who is only added is told from all others, however the file calls them."""
    change = replace(change, moved=(), removed=())
    found, notes = find_difference(street(), renamed(apply(street(), change)), shown(street()))
    assert (notes, found.moved, found.removed) == ((), (), ())
    assert are_alike(found, change)


def test_without_names_one_of_its_size_is_taken_for_the_same_and_a_close_call_is_named() -> None:
    source = replace(street(), agents=street().agents[:1])
    after = renamed(replace(source, agents=(replace(source.agents[0], x_m=26.0),)))
    found, notes = find_difference(source, after, shown(source))
    assert ([one.id for one in found.moved], found.added, notes) == (["Agent2"], (), ())
    twins = (*after.agents, replace(after.agents[0], id="Agent3", x_m=13.5))
    found, notes = find_difference(source, replace(after, agents=twins), shown(source))
    assert [one.x_m for one in found.moved] == [26.0]
    assert [one.x_m for one in found.added] == [13.5]
    assert notes == (
        "Agent2: several agents of this size are about as near; the nearest are taken for the "
        "same.",
    )


def test_a_number_counts_for_a_box_of_one_size_alone() -> None:
    source = replace(street(), agents=street().agents[:1])
    bus = replace(source.agents[0], x_m=60.0, length_m=9.0)
    view = shown(source, names={"Agent2": "Agent2"})
    found, _ = find_difference(source, replace(source, agents=(bus,)), view)
    assert (found.removed, [one.x_m for one in found.added]) == (("Agent2",), [60.0])
    found, _ = find_difference(source, replace(source, agents=(replace(bus, length_m=4.8),)), view)
    assert [one.x_m for one in found.moved] == [60.0]


def test_an_ego_elsewhere_is_aligned_where_the_frames_are_the_same() -> None:
    source = replace(street(), origin=Origin(frame="city", x_m=10.0, y_m=5.0, heading_rad=0.5))
    ego = Origin(frame="city", x_m=13.0, y_m=9.0, heading_rad=-0.2)
    agents = []
    for agent in source.agents:
        seen = ego.pose.pose_to_local(pose_in_parent(source.origin.pose, agent.pose))
        turned = replace(agent, heading_rad=seen.heading_rad)
        agents.append(replace(turned, x_m=seen.x_m, y_m=seen.y_m))
    found, notes = find_difference(source, replace(source, origin=ego, agents=tuple(agents)))
    assert found.is_empty
    assert notes[0].startswith("Its ego stands 5.00 m from the source's; all others were brought")
    elsewhere = replace(ego, frame="another")
    _, notes = find_difference(source, replace(source, origin=elsewhere))
    assert notes == ("Its frame, 'another', is not known here: its ego is taken for the source's",)


def test_a_motion_is_a_change_in_the_sources_frame_and_waits_for_who_is_meant() -> None:
    source = replace(street(), origin=Origin(frame="city", x_m=0.0, y_m=0.0, heading_rad=0.0))
    ego = Origin(frame="city", x_m=10.0, y_m=0.0, heading_rad=math.pi / 2.0)
    given = Modification(
        added=(_that_waits("Agent50", for_whom="Agent51"), _that_waits("Agent51", for_whom="me")),
        moved=(_that_waits("Agent3", for_whom="Agent50"),),
    )
    after = replace(source, origin=ego, agents=given.changed)
    found, _ = find_difference(source, after)
    named = number_added(source, found)
    assert [one.id for one in named.added] == ["Agent12", "Agent13"]
    starts = {one.id: one.motion.start for one in named.changed if one.motion is not None}
    waits = {name: one.agent_id for name, one in starts.items() if isinstance(one, AtPlace)}
    assert waits == {"Agent12": "Agent13", "Agent13": "me", "Agent3": "Agent12"}
    # 5 m ahead and 1 m left of an ego that stands at (10, 0) and looks left.
    (path,) = {one.motion.path for one in named.changed if one.motion is not None}
    assert isinstance(path, PointPath)
    assert path.points_m[0] == pytest.approx((9.0, 5.0))


def _that_waits(name: str, *, for_whom: str) -> TrafficAgent:
    start = AtPlace(agent_id=for_whom, x_m=5.0, y_m=1.0)
    motion = PlannedMotion(path=PointPath(points_m=((5.0, 1.0),)), start=start)
    return replace(vehicle(name, 30.0, 0.0), motion=motion)


def test_what_a_format_can_not_say_is_named_and_stays(tmp_path: Path) -> None:
    content = through("commonroad", Modification(removed=("Agent2",)), tmp_path)
    view = identify(show_source(TASK, "commonroad"), content)
    found, notes = find_difference(street(), content.scene, view)
    assert found == Modification(removed=("Agent2",))
    (barrier,) = (one.id for one in street().agents if one.type is AgentType.BARRIER)
    assert notes == (f"{barrier}: not said in this format, taken to stay.",)
