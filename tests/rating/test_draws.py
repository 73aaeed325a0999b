"""Fast multinomial draws are multinomial draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arena.rating.comparisons import FloatArray
from arena.rating.draws import AliasTables, Multinomial, alias_tables, poisson_tables
from tests.properties import examples


def chances_of(tables: AliasTables, row: int) -> dict[float, float]:
    """What a table gives, added up over its columns."""
    columns = tables.columns
    limit = tables.limit.reshape(-1, columns)[row].astype(np.float64) / 2.0**64
    values = tables.value.reshape(-1, columns, 2)[row]
    found: dict[float, float] = {}
    for below, (above_value, own_value) in zip(limit, values, strict=True):
        found[own_value] = found.get(own_value, 0.0) + below / columns
        found[above_value] = found.get(above_value, 0.0) + (1.0 - below) / columns
    return found


@given(
    st.lists(
        st.lists(st.floats(0.0, 1.0), min_size=8, max_size=8).filter(lambda row: sum(row) > 0.01),
        min_size=1,
        max_size=4,
    )
)
@examples(100)
def test_an_alias_table_gives_each_value_its_chance(rows: list[list[float]]) -> None:
    chances: FloatArray = np.array(rows, dtype=np.float64)
    chances /= chances.sum(axis=1, keepdims=True)
    values = np.tile(np.arange(8.0), (len(rows), 1))
    tables = alias_tables(values, chances)
    for row, wanted in enumerate(chances):
        found = chances_of(tables, row)
        assert [found.get(float(value), 0.0) for value in range(8)] == pytest.approx(
            wanted.tolist(), abs=1e-9
        )


@pytest.mark.parametrize("mean", [0.0, 0.3, 4.0, 60.0, 900.0])
def test_poisson_tables_have_the_poisson_chances(mean: float) -> None:
    tables = poisson_tables(np.array([mean]))
    assert tables is not None
    for value, chance in chances_of(tables, 0).items():
        log = value * math.log(mean) - mean - math.lgamma(value + 1) if mean else -math.inf
        wanted = math.exp(log) if mean else float(value == 0)
        assert chance == pytest.approx(wanted, abs=1e-10)


@given(st.lists(st.integers(1, 400), min_size=1, max_size=6), st.integers(0, 2**32))
@examples(60)
def test_every_round_has_as_many_votes_as_there_are(counts: list[int], seed: int) -> None:
    drawn = Multinomial(np.array(counts)).draw(np.random.default_rng(seed), 50)
    assert (drawn.sum(axis=0) == sum(counts)).all()
    assert (drawn >= 0).all()
    assert (drawn == np.rint(drawn)).all()


def test_means_and_covariances_are_those_of_a_multinomial() -> None:
    counts = np.array([1, 2, 3, 50, 7])
    drawn = Multinomial(counts).draw(np.random.default_rng(1), 200_000)
    share = counts / counts.sum()
    assert drawn.mean(axis=1) == pytest.approx(counts, abs=0.05)
    wanted = counts.sum() * (np.diag(share) - np.outer(share, share))
    assert np.cov(drawn) == pytest.approx(wanted, abs=0.15)


def test_counts_too_large_for_tables_are_drawn_all_the_same() -> None:
    counts = np.array([60_000_000, 30_000_000, 10])
    assert poisson_tables(counts.astype(np.float64)) is None
    shares = counts[:2] / counts.sum()
    large = Multinomial(np.array([600_000, 300_000, 10]))
    drawn = large.draw(np.random.default_rng(1), 500)
    assert drawn[:2].mean(axis=1) / drawn.sum(axis=0)[0] == pytest.approx(shares, abs=1e-3)
