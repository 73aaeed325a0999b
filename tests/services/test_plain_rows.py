"""Rows by plain SQL are the instances that the ORM would give."""

from __future__ import annotations

import pytest
from pytest_django import DjangoAssertNumQueries

from arena.models import Matchup
from arena.queries.plain import instances
from tests.study_rows import a_study, matchups_of

pytestmark = pytest.mark.django_db
NAMES = ("view", "code", "served_at", "id", "expert_id")
SQL = "SELECT view, code, served_at, id, expert_id, position + %(more)s FROM arena_matchup"


def test_columns_in_any_order_become_what_the_orm_makes_of_them(
    django_assert_num_queries: DjangoAssertNumQueries,
) -> None:
    matchup = matchups_of(a_study(), "eva")[0]
    with django_assert_num_queries(1):
        rows = instances(Matchup, NAMES, f"{SQL} WHERE id = %(id)s", {"id": matchup.pk, "more": 7})
    ((found, behind),) = rows
    assert found == matchup
    assert {name: getattr(found, name) for name in NAMES} == {
        name: getattr(matchup, name) for name in NAMES
    }
    assert behind == (matchup.position + 7,)
