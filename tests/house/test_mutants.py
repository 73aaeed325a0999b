"""Every mutation fits the source: else `make mutants` would say nothing of it."""

import ast

import pytest

from tests.mutants.mutation import ROOT, Mutation, mutations

ALL = mutations()


def test_there_are_enough_of_them_and_each_has_a_name_of_its_own() -> None:
    assert len(ALL) >= 60
    assert len({one.name for one in ALL}) == len(ALL)


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_a_mutation_changes_one_place_of_a_file_that_still_can_be_read(one: Mutation) -> None:
    text = (ROOT / one.file).read_text()
    assert text.count(one.old) == 1
    assert one.new != one.old
    ast.parse(text.replace(one.old, one.new))
    assert one.tests
    for test in one.tests:
        path, _, name = test.partition("::")
        assert (ROOT / path).exists()
        assert not name or f"def {name}(" in (ROOT / path).read_text()
