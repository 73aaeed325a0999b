from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from arena.rating.reliability import cohens_kappa

answers = st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=40)


def test_a_table_worked_out_by_hand() -> None:
    # 20 times both yes, 5 only the first, 10 only the second, 15 both no: 35 of 50 agree, and
    # 0.5 x 0.6 + 0.5 x 0.4 = 0.5 would by chance: (0.7 - 0.5) / 0.5.
    pairs = [(True, True)] * 20 + [(True, False)] * 5 + [(False, True)] * 10
    pairs += [(False, False)] * 15
    first, second = zip(*pairs, strict=True)
    assert cohens_kappa(first, second) == pytest.approx(0.4)


def test_full_agreement_is_one_and_full_disagreement_minus_one() -> None:
    assert cohens_kappa([True, False], [True, False]) == 1.0
    assert cohens_kappa([True, False], [False, True]) == -1.0


@pytest.mark.parametrize("same", [[], [True], [False, False]])
def test_where_nobody_ever_differs_there_is_nothing_to_tell(same: list[bool]) -> None:
    assert cohens_kappa(same, same) is None


def test_unpaired_answers_are_refused() -> None:
    with pytest.raises(ValueError, match="1 answers against 2"):
        cohens_kappa([True], [True, False])


@given(pairs=answers)
def test_it_is_symmetric_and_never_above_one(pairs: list[tuple[bool, bool]]) -> None:
    first, second = [one for one, _ in pairs], [other for _, other in pairs]
    kappa = cohens_kappa(first, second)
    assert kappa == cohens_kappa(second, first)
    assert kappa is None or kappa <= 1.0
