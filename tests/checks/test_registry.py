"""Whatever the modification: no error, true sentences, and the same findings wherever it lies."""

import math
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.checks import Finding, FindingKind, Ground, Severity
from augment.checks.registry import check_against_intent
from augment.geometry.frames import Pose
from augment.scene.entities import AgentType, Area, AreaKind, Modification, Scene, TrafficAgent
from augment.scene.intent import Facing, Intent, VehicleRequest
from tests.checks.worlds import findings, severities
from tests.fixtures.shelf import SLUGS, entry, shown_scene
from tests.recorded import recorded
from tests.scenes import cone, curve, junction, moved_agent, moved_scene, scene, vehicle

WORLDS = (
    scene(),
    scene(agents=(vehicle("Agent20", 30.0, 0.3), cone("Agent21", 12.0, 3.0))),
    curve(),
    junction(),
    scene(lanes=()),
    scene(areas=()),
    scene(lanes=(), areas=()),
    scene(
        areas=(Area(id="A", kind=AreaKind.DRIVABLE, boundary_m=((0, 0), (9, 9), (9, 0), (0, 9))),)
    ),
)
PLACEABLE = [kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE]


def odd(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers off every threshold, where rounding of a moved scene would decide."""
    steps = st.integers(math.ceil(low * 97.0), math.floor(high * 97.0))
    return steps.map(lambda step: step / 97.0 + 0.00213)


def agents(number: st.SearchStrategy[float], most_m: float) -> st.SearchStrategy[TrafficAgent]:
    return st.builds(
        TrafficAgent,
        id=st.sampled_from(["Agent2", "Agent3", "Agent4"]),
        type=st.sampled_from(PLACEABLE),
        lane_id=st.sampled_from([None, "Lane1", "Connector1", "Lane77"]),
        walk_to_m=st.none() | st.tuples(number, number),
        **{"x_m": number, "y_m": number, "heading_rad": odd(-6.2, 6.2)},
        **{"width_m": odd(0.1, most_m), "length_m": odd(0.1, most_m), "speed_mps": odd(0.0, 99.0)},
    )


def changes(number: st.SearchStrategy[float], most_m: float) -> st.SearchStrategy[Modification]:
    added = st.lists(agents(number, most_m), max_size=3, unique_by=lambda agent: agent.id)
    return added.map(lambda several: Modification(added=tuple(several)))


@given(
    st.sampled_from(WORLDS),
    changes(
        st.floats(-100_000.0, 100_000.0) | st.sampled_from([0.0, 1.75, 3.5, 20.0, -50.0]), 90.0
    ),
)
def test_no_modification_raises(world: Scene, change: Modification) -> None:
    found = findings(world, change)
    changed = [agent.id for agent in change.changed]
    assert [changed.index(one.agents[0]) for one in found] == sorted(
        changed.index(one.agents[0]) for one in found
    )
    for one in found:
        assert all(map(math.isfinite, one.measured.values()))
        assert one.agents[0] in one.sentence()
        assert one.sentence().endswith(".")


@given(
    st.sampled_from(WORLDS),
    changes(odd(-20.0, 60.0), 9.0),
    st.builds(Pose, x_m=odd(-900, 900), y_m=odd(-900, 900), heading_rad=odd(-3.1, 3.1)),
)
def test_findings_do_not_ask_where_the_world_lies(
    world: Scene, change: Modification, frame: Pose
) -> None:
    moved = Modification(added=tuple(moved_agent(agent, frame) for agent in change.added))
    here = findings(world, change)
    there = findings(moved_scene(world, frame), moved)
    assert _told(here) == _told(there)
    for one, other in zip(here, there, strict=True):
        for name in one.measured.keys() - {"lane_heading_rad"}:
            assert other.measured[name] == pytest.approx(one.measured[name], abs=1e-5), name


@given(st.floats(1e-320, 1e-3))
def test_boxes_of_no_size_raise_nothing(size_m: float) -> None:
    speck = vehicle("Agent2", 0.0, 0.0, width_m=size_m, length_m=size_m)
    kinds = {one.kind for one in findings(scene(), Modification(added=(speck,)))}
    assert {FindingKind.SIZE, FindingKind.OVERLAP} <= kinds


def _told(found: tuple[Finding, ...]) -> list[object]:
    return [(one.kind, one.severity, one.agents, one.lanes) for one in found]


OFF = Finding(
    kind=FindingKind.LANE,
    severity=Severity.FACT,
    agents=("Agent2",),
    lanes=("42811-b",),
    measured={"off_m": 7.28},
    template="{agents[0]} is {off_m:.1f} m off {lanes[0]}.",
)


def test_its_sentence_calls_things_what_the_reader_calls_them() -> None:
    assert OFF.sentence() == "Agent2 is 7.3 m off 42811-b."
    names = {"42811-b": "Lane3", "Agent2": "{lanes[0]}"}
    assert OFF.sentence(names) == "{lanes[0]} is 7.3 m off Lane3."


FACING = {"nudge-ferry-road", "overtake-terrace-row-facing"}
"""Here the instruction asks for a vehicle that faces the traffic."""


@pytest.mark.parametrize("slug", SLUGS)
def test_a_reference_has_nothing_wrong(slug: str) -> None:
    asked_for = {(FindingKind.HEADING, Severity.DOUBTFUL)} if slug in FACING else set()
    assert severities(findings(shown_scene(slug), entry(slug).reference)) == asked_for


DRIVES_MPS = 2.0


@pytest.mark.slow
@pytest.mark.realdata
def test_most_recorded_vehicles_have_nothing_wrong_and_none_is_impossible(realdata: Path) -> None:
    totals, faulty, unplaced = Counter[str](), Counter[str](), Counter[str]()
    never = {FindingKind.SIZE, FindingKind.SPEED, FindingKind.LANE_NAMED}
    for frame in (0, 30, 60, 90, 120, 150):
        base, _ = recorded(realdata, frame)
        found = findings(base, Modification(moved=base.agents))
        wrong = [one for one in found if one.severity is Severity.WRONG]
        assert [one.sentence() for one in wrong if one.kind in never] == []
        for agent in (one for one in base.agents if one.type is AgentType.VEHICLE):
            group = "driving" if agent.speed_mps > DRIVES_MPS else "standing or creeping"
            kinds = {one.kind for one in wrong if one.agents[0] == agent.id}
            totals[group] += 1
            faulty[group] += bool(kinds)
            unplaced[group] += bool(kinds - {FindingKind.OVERLAP})
    # Yards are off the map's road, and some boxes were annotated twice or into each other.
    assert faulty["driving"] <= 0.05 * totals["driving"]
    assert unplaced["standing or creeping"] <= 0.25 * totals["standing or creeping"]
    assert faulty.total() <= 0.25 * totals.total()


def test_a_direction_that_is_held_against_no_lane_leaves_its_doubt() -> None:
    wish = Intent(requests=(VehicleRequest(facing=Facing.WITH_LANE, count=1),))
    across = Modification(added=(vehicle("Added1", 40.0, 0.0, 1.5),))
    findings = check_against_intent(Ground.of(scene()), across, wish)
    headings = [one.severity for one in findings if one.kind is FindingKind.HEADING]
    assert headings == [Severity.DOUBTFUL]
