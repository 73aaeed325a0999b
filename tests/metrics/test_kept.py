"""What a follow-up moved beside what it was to move: a car goes on, a cone and a walker stay."""

from dataclasses import replace

import pytest

from augment.metrics.kept import KeptObject, KeptSummary, find_kept_objects, summarise_kept
from augment.scene.entities import Modification, TrafficAgent
from tests.scenes import cone, pedestrian, vehicle

CAR, CONE, WALKER = vehicle("r1", 20.0, 0.0), cone("r2", 30.0, 1.0), pedestrian("r3", 12.0, -4.0)


def placed(*agents: TrafficAgent) -> Modification:
    return Modification(added=agents)


REFERENCE = placed(CAR, CONE, WALKER)
FOLLOW_UP = placed(replace(CAR, x_m=24.0), CONE, WALKER)


def kept(before: Modification, after: Modification | None) -> tuple[KeptObject, ...]:
    return find_kept_objects(before, after, reference_before=REFERENCE, reference_after=FOLLOW_UP)


def test_only_what_both_references_have_alike_is_to_be_kept() -> None:
    found = kept(REFERENCE, FOLLOW_UP)
    assert [(one.id, one.distance_m, one.is_kept) for one in found] == [
        ("r2", 0.0, True),
        ("r3", 0.0, True),
    ]


def test_it_is_measured_from_ones_own_answer_whatever_the_reference_says() -> None:
    own = [replace(one, id=f"own-{one.id}", y_m=one.y_m + 2.0) for one in REFERENCE.added]
    for after, distance_m in (
        (replace(CONE, x_m=30.1), 0.1),  # as near as things that look the same
        (replace(CONE, x_m=30.5), 0.5),
        (replace(CONE, y_m=4.0), 3.0),
    ):
        moved = replace(after, id="new", y_m=after.y_m + 2.0)
        first, _ = kept(placed(*own), placed(own[0], moved, own[2]))
        assert first.id == "own-r2"
        assert first.distance_m == pytest.approx(distance_m)
        assert first.is_kept is (distance_m < 0.15)


def test_what_is_gone_turned_or_of_no_answer_at_all_was_not_kept() -> None:
    bare = placed(CAR, WALKER)
    assert kept(REFERENCE, bare)[0] == KeptObject(id="r2", distance_m=None, is_kept=False)
    turned = kept(
        REFERENCE, placed(CAR, CONE, replace(WALKER, heading_rad=WALKER.heading_rad + 1))
    )
    assert (turned[1].distance_m, turned[1].is_kept) == (0.0, False)
    assert summarise_kept(kept(REFERENCE, None)) == KeptSummary(
        to_keep=2, kept=0, moved_mean_m=None
    )


def test_what_the_answer_before_never_placed_is_not_asked_for() -> None:
    assert [one.id for one in kept(placed(CAR, WALKER), placed(CAR))] == ["r3"]
    assert summarise_kept(()) is None


def test_a_summary_counts_objects_and_averages_those_that_are_there() -> None:
    parts = [("a", 0.0, True), ("b", 3.0, False), ("c", None, False)]
    found = [KeptObject(id=n, distance_m=d, is_kept=k) for n, d, k in parts]
    assert summarise_kept(found) == KeptSummary(to_keep=3, kept=1, moved_mean_m=1.5)
