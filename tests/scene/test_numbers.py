"""Numbers of documents by their paths: listed, set, drawn, spaced."""

from typing import Any

import numpy as np
import pytest

from augment.errors import InvalidDocument, UnknownName
from augment.scene.codec import intent_from_document, intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Intent, Relation, Spot, VehicleRequest
from augment.scene.numbers import draw_ranges, list_numbers, set_number, sweep_values
from tests.intents import metres
from tests.scenes import vehicle

GAP = "requests[0].spot.distance"


def gap(low_m: float, high_m: float | None = None) -> dict[str, Any]:
    spot = Spot(distance=metres(low_m, high_m), relation=Relation.AHEAD)
    return intent_to_document(
        Intent(requests=(VehicleRequest(spot=spot, speed_mps=0.0, count=2),))
    )


def test_an_intent_names_its_numbers_by_their_paths_and_a_range_is_one() -> None:
    assert list_numbers(gap(8.0, 20.0)) == {
        GAP: 8.0,
        "requests[0].speed_mps": 0.0,
        "requests[0].count": 2.0,
    }


@pytest.mark.parametrize(
    ("name", "value", "read"),
    [
        (GAP, 12.5, lambda intent: intent.requests[0].spot.distance == metres(12.5)),
        ("requests[0].count", 3.0, lambda intent: intent.requests[0].count == 3),
        ("requests[0].speed_mps", 7.5, lambda intent: intent.requests[0].speed_mps == 7.5),
    ],
)
def test_a_set_number_is_read_back_and_all_else_stays(name: str, value: float, read: Any) -> None:
    before = gap(8.0, 20.0)
    after = set_number(before, name, value)
    assert read(intent_from_document(after))
    assert list_numbers(after) == list_numbers(before) | {name: value}
    assert before == gap(8.0, 20.0), "the given document is not touched"


def test_a_number_of_a_modification_is_set() -> None:
    document = modification_to_document(Modification(added=(vehicle("Agent2", 20.0, 1.0),)))
    assert set_number(document, "add[0].y_m", 2.25)["add"][0]["y_m"] == 2.25


def test_an_unknown_path_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(UnknownName, match=r"spot\.distance"):
        set_number(gap(8.0), "requests[1].spot.distance", 9.0)


def test_ranges_are_drawn_evenly_within_their_bounds_and_exact_numbers_stay() -> None:
    rng = np.random.default_rng(1)
    drawn = [list_numbers(draw_ranges(gap(8.0, 20.0), rng)) for _ in range(400)]
    gaps = [numbers[GAP] for numbers in drawn]
    assert 8.0 <= min(gaps) < 8.5
    assert 19.5 < max(gaps) <= 20.0
    assert np.mean(gaps) == pytest.approx(14.0, abs=3.0 * 12.0 / np.sqrt(12.0 * 400.0))
    assert draw_ranges(gap(8.0), rng) == gap(8.0)


def test_a_range_without_a_unit_in_its_names_is_drawn_too() -> None:
    document = {
        "motion": {"speed_mps": {"low": 2.0, "high": 4.0}, "start": {"after_s": {"low": 1.0}}}
    }
    drawn = list_numbers(draw_ranges(document, np.random.default_rng(1)))
    assert 2.0 <= drawn.pop("motion.speed_mps") <= 4.0
    assert drawn == {"motion.start.after_s": 1.0}


def test_values_are_evenly_spaced_and_bounded() -> None:
    assert sweep_values(8.0, 20.0, 4) == (8.0, 12.0, 16.0, 20.0)
    assert sweep_values(0.0, 0.3, 4) == (0.0, 0.1, 0.2, 0.3)
    for low, high, count in ((1.0, 1.0, 4), (2.0, 1.0, 4), (0.0, 1.0, 1), (0.0, 1.0, 101)):
        with pytest.raises(InvalidDocument):
            sweep_values(low, high, count)
    with pytest.raises(InvalidDocument, match="too short for 3 values"):
        sweep_values(0.0, 1e-9, 3)
    with pytest.raises(InvalidDocument, match="high"):
        sweep_values(0.0, float("nan"), 3)
