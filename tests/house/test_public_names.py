"""No link, script, program or stored file breaks by a renaming."""

from collections import defaultdict
from importlib import import_module

import pytest

from tests.house.public_names import public_names
from tests.house.source import ROOT

IMPORTED = {
    "augment.simulation.planning": ("Plan", "Situation"),
    "augment.simulation.road": ("Road",),
    "augment.simulation.states": ("EgoBody",),
    "arena.rating.leaderboard": ("rate",),
}
"""What docs/rating.md and docs/simulation.md tell readers to import."""


def test_every_public_name_is_still_there() -> None:
    now = defaultdict(set)
    for owner, name in public_names():
        now[owner].add(name)
    lines = (ROOT / "tests" / "house" / "public_names.txt").read_text().splitlines()
    listed = {
        owner: set(names.split(", "))
        for owner, _, names in (line.partition(": ") for line in lines)
    }
    assert len(listed) > 200
    gone = {owner: names - now[owner] for owner, names in listed.items() if names - now[owner]}
    assert not gone


@pytest.mark.parametrize("module", IMPORTED)
def test_programs_of_others_import_as_before(module: str) -> None:
    assert all(hasattr(import_module(module), name) for name in IMPORTED[module])
