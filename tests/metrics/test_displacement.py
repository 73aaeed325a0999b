import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.metrics.displacement import (
    CLASS_OF,
    Displacement,
    Match,
    ObjectClass,
    are_alike,
    displacement,
    look_alike,
    summarise,
    summarize_box,
)
from augment.scene.entities import AgentType, Modification, TrafficAgent
from augment.scene.planned_motion import AtTime, LanePath, NearEgo, PlannedMotion
from tests.scenes import cone, pedestrian, vehicle


def placed(*agents: TrafficAgent) -> Modification:
    return Modification(added=agents)


def test_the_matching_has_the_smallest_sum_within_each_class() -> None:
    for generated, reference, matched, distances_m, missing, surplus in (
        # g1 is nearest to r1 (1 m), but then g2 is 9 m from r2: 10 m. Crosswise it is 4 + 4 m.
        (
            placed(vehicle("g1", 1.0, 0.0), vehicle("g2", -4.0, 0.0)),
            placed(vehicle("r1", 0.0, 0.0), vehicle("r2", 5.0, 0.0)),
            *({"g1": "r2", "g2": "r1"}, [4.0, 4.0], (), ()),
        ),
        # Straight 0 + 5 m, crosswise 3 + 3 m: squares would take the second.
        (
            placed(vehicle("g1", 0.0, 0.0), vehicle("g2", -7.0 / 6.0, 2.7638539919628333)),
            placed(vehicle("r1", 0.0, 0.0), vehicle("r2", 3.0, 0.0)),
            *({"g1": "r1", "g2": "r2"}, [0.0, 5.0], (), ()),
        ),
        (  # of two wanted the one without a counterpart is missing
            placed(vehicle("g1", 18.0, 0.0)),
            placed(vehicle("r1", 0.0, 0.0), vehicle("r2", 20.0, 0.0)),
            *({"g1": "r2"}, [2.0], ("r1",), ()),
        ),
        (  # of three placed the two farthest are surplus
            placed(cone("g1", 9.0, 0.0), cone("g2", 10.5, 0.0), cone("g3", 40.0, 0.0)),
            placed(cone("r1", 10.0, 0.0)),
            *({"g2": "r1"}, [0.5], (), ("g1", "g3")),
        ),
        (  # nothing stands for an object of another class
            placed(vehicle("g1", 10.0, 0.0), cone("g2", 21.0, 0.0)),
            placed(pedestrian("r1", 10.0, 0.0), cone("r2", 20.0, 0.0)),
            *({"g2": "r2"}, [1.0], ("r1",), ("g1",)),
        ),
        (  # a bus stands for a car
            placed(replace(vehicle("g1", 12.0, 0.0), type=AgentType.BUS)),
            placed(vehicle("r1", 10.0, 0.0)),
            *({"g1": "r1"}, [2.0], (), ()),
        ),
        (  # a moved object counts where it went and a removed one not at all
            Modification(moved=(vehicle("g1", 10.0, 3.0),)),
            Modification(moved=(vehicle("r1", 10.0, 0.0),), removed=("Agent3",)),
            *({"g1": "r1"}, [3.0], (), ()),
        ),
    ):
        found = displacement(generated, reference)
        assert {match.generated: match.reference for match in found.matches} == matched
        assert sorted(found.distances_m) == pytest.approx(distances_m)
        assert (found.missing, found.surplus) == (missing, surplus)


def test_no_answer_and_an_empty_one_miss_everything_and_an_empty_reference_wants_nothing() -> None:
    found = displacement(None, placed(vehicle("r1", 0.0, 0.0), cone("r2", 1.0, 0.0)))
    assert found == Displacement(missing=("r1", "r2"))
    assert found.mean_m is None
    one = placed(vehicle("a", 0.0, 0.0))
    assert displacement(Modification(), one).missing == ("a",)
    assert displacement(one, Modification()).surplus == ("a",)
    assert displacement(Modification(), Modification()) == Displacement()


# Properties

MAKERS = (vehicle, cone, pedestrian)
metres = st.floats(-60.0, 60.0)


@st.composite
def changes(draw: st.DrawFn) -> Modification:
    places = draw(st.lists(st.tuples(st.sampled_from(MAKERS), metres, metres), max_size=6))
    return placed(*(make(f"a{n}", x_m, y_m) for n, (make, x_m, y_m) in enumerate(places)))


@given(generated=changes(), reference=changes())
def test_every_object_is_matched_or_counted_once_and_all_with_themselves(
    generated: Modification, reference: Modification
) -> None:
    found = displacement(generated, reference)
    assert len(found.matches) + len(found.missing) == len(reference.added)
    assert len(found.matches) + len(found.surplus) == len(generated.added)
    same = displacement(reference, reference)
    assert same.distances_m == (0.0,) * len(reference.added)
    assert (same.missing, same.surplus) == ((), ())


@given(generated=changes(), reference=changes())
def test_no_matching_has_a_smaller_sum(generated: Modification, reference: Modification) -> None:
    """Every matching is tried, class by class."""
    found = displacement(generated, reference)
    for name in set(CLASS_OF.values()):
        wanted = [one for one in reference.changed if CLASS_OF[one.type] is name]
        placed_ = [one for one in generated.changed if CLASS_OF[one.type] is name]
        few, many = sorted((wanted, placed_), key=len)
        smallest = min(
            sum(
                math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)
                for one, other in zip(few, order, strict=True)
            )
            for order in itertools.permutations(many, len(few))
        )
        made = sum(one.distance_m for one in found.matches if one.object_class is name)
        assert made == pytest.approx(smallest, rel=1e-4, abs=1e-6)


def test_of_equal_sums_the_even_one_counts_in_whatever_order() -> None:
    reference = placed(vehicle("r1", 1.0, 0.0), vehicle("r2", 2.0, 0.0))
    cars = (vehicle("g1", 0.0, 0.0), vehicle("g2", 1.0, 0.0))
    for order in itertools.permutations(cars):
        assert displacement(placed(*order), reference).distances_m == (1.0, 1.0)


CAR = vehicle("New1", 20.0, 0.0)
WALKER = pedestrian("New2", 10.0, -4.0, (10.0, 4.0))


BRAKING = PlannedMotion(speeds=((0.0, 8.0), (2.0, 0.0)), start=NearEgo(within_m=15.0))


def test_two_motions_against_the_tolerance() -> None:
    for changed, alike in (
        (BRAKING, True),
        (replace(BRAKING, start=NearEgo(within_m=15.15)), True),
        (replace(BRAKING, start=NearEgo(within_m=15.16)), False),
        (replace(BRAKING, speeds=((0.0, 8.1), (2.1, 0.0))), True),
        (replace(BRAKING, speeds=((0.0, 8.0), (2.2, 0.0))), False),
        (replace(BRAKING, speeds=((0.0, 8.0),)), False),
        (replace(BRAKING, start=AtTime(after_s=15.0)), False),
        (replace(BRAKING, path=LanePath(lane_ids=("Lane1",))), False),
        (None, False),
    ):
        one, other = replace(CAR, motion=BRAKING), replace(CAR, motion=changed)
        assert look_alike(one, other) is alike
        assert look_alike(other, one) is alike


def test_one_object_against_the_tolerance() -> None:
    for changed, alike in (
        (CAR, True),
        (replace(CAR, id="New9"), True),
        (replace(CAR, x_m=20.1), True),
        (replace(CAR, x_m=20.11), False),
        (replace(CAR, x_m=20.08, y_m=0.08), False),
        (replace(CAR, heading_rad=math.radians(2.0)), True),
        (replace(CAR, heading_rad=math.radians(-2.5)), False),
        (replace(CAR, heading_rad=math.pi), False),
        (replace(CAR, length_m=5.1), False),
        (replace(CAR, speed_mps=0.2), False),
        (replace(CAR, type=AgentType.BUS), False),
    ):
        one, other = Modification(added=(CAR,)), Modification(added=(changed,))
        assert are_alike(one, other) is alike
        assert are_alike(other, one) is alike


def test_every_object_is_matched_once() -> None:
    row = [cone(f"New{n}", 10.0 + 0.14 * n, 0.0) for n in range(3)]
    assert are_alike(Modification(added=tuple(row)), Modification(added=tuple(reversed(row))))
    assert not are_alike(Modification(added=tuple(row)), Modification(added=tuple(row[:2])))
    doubled = Modification(added=(row[0], replace(row[0], id="New8"), row[2]))
    apart = Modification(added=(row[0], replace(row[2], id="New8"), row[2]))
    assert not are_alike(doubled, apart)
    assert are_alike(Modification(), Modification())


def test_walks_cones_and_what_is_gone() -> None:
    far = replace(WALKER, walk_to_m=(10.0, 4.2))
    aside = replace(WALKER, heading_rad=WALKER.heading_rad + math.radians(9.0))
    assert are_alike(Modification(added=(WALKER,)), Modification(added=(aside,)))
    assert not are_alike(Modification(added=(WALKER,)), Modification(added=(far,)))
    turned = replace(cone("New1", 5.0, 0.0), heading_rad=1.0)
    assert are_alike(Modification(added=(cone("New1", 5.0, 0.0),)), Modification(added=(turned,)))
    assert not are_alike(Modification(removed=("Agent2",)), Modification())
    assert not are_alike(Modification(moved=(CAR,)), Modification(added=(CAR,)))


def of(*distances_m: float, missing: int = 0, surplus: int = 0) -> Displacement:
    return Displacement(
        matches=tuple(
            Match(reference="r", generated="g", object_class=ObjectClass.VEHICLE, distance_m=one)
            for one in distances_m
        ),
        missing=("r",) * missing,
        surplus=("g",) * surplus,
    )


def test_quartiles_whiskers_and_outliers_of_a_row_of_numbers() -> None:
    box = summarize_box([5.0, 1.0, 3.0, 2.0, 4.0, 30.0, 6.0])
    assert (box.q1_m, box.median_m, box.q3_m) == (2.5, 4.0, 5.5)
    assert (box.low_m, box.high_m) == (1.0, 6.0)
    assert box.outliers_m == (30.0,)
    assert box.mean_m == pytest.approx(51.0 / 7.0)


def test_objects_of_all_augmentations_count_once_each() -> None:
    found = summarise([of(1.0, 3.0), of(2.0, surplus=2), of(missing=4)])
    assert (found.augmentations, found.n, found.missing, found.surplus) == (3, 3, 4, 2)
    assert found.box.median_m == 2.0


@given(values=st.lists(st.floats(0.0, 1e3), min_size=1, max_size=40))
def test_a_box_is_in_order_and_loses_no_value(values: list[float]) -> None:
    box = summarize_box(values)
    numbers = [box.low_m, box.q1_m, box.median_m, box.q3_m, box.high_m]
    assert numbers == sorted(numbers)
    inside = [one for one in values if box.low_m <= one <= box.high_m]
    assert len(inside) + len(box.outliers_m) == len(values)
    assert box.median_m == pytest.approx(float(np.median(values)))
