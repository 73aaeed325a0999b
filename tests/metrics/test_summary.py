from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.metrics.displacement import Displacement, Match, ObjectClass, box_of, summarise


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
    box = box_of([5.0, 1.0, 3.0, 2.0, 4.0, 30.0, 6.0])
    assert (box.q1_m, box.median_m, box.q3_m) == (2.5, 4.0, 5.5)
    assert (box.low_m, box.high_m) == (1.0, 6.0)
    assert box.outliers_m == (30.0,)
    assert box.mean_m == pytest.approx(51.0 / 7.0)


def test_objects_of_all_augmentations_count_once_each() -> None:
    found = summarise([of(1.0, 3.0), of(2.0, surplus=2), of(missing=4)])
    assert (found.augmentations, found.n, found.missing, found.surplus) == (3, 3, 4, 2)
    assert found.box is not None
    assert found.box.median_m == 2.0


@given(values=st.lists(st.floats(0.0, 1e3), min_size=1, max_size=40))
def test_a_box_is_in_order_and_loses_no_value(values: list[float]) -> None:
    box = box_of(values)
    numbers = [box.low_m, box.q1_m, box.median_m, box.q3_m, box.high_m]
    assert numbers == sorted(numbers)
    inside = [one for one in values if box.low_m <= one <= box.high_m]
    assert len(inside) + len(box.outliers_m) == len(values)
    assert box.median_m == pytest.approx(float(np.median(values)))
