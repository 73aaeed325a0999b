"""A type of scenario beyond the paper's five is a slug with a label, kept apart everywhere."""

from __future__ import annotations

import pytest

from arena.templatetags.results import type_label
from augment.errors import Conflict, InvalidDocument
from augment.models import Scenario
from augment.services.scenarios.scenes import add_scenario
from augment.services.scenarios.types import type_choices
from tests.jobs import rows

pytestmark = pytest.mark.django_db


def add(slug: str, type: str, label: str | None = None) -> Scenario:
    if not Scenario.objects.exists():
        rows.add_scenario("street")
    return add_scenario(
        scene="street-scene",
        type=type,
        type_label=label,
        slug=slug,
        instruction="Let a car cut in.",
        reference=Scenario.objects.get(slug="street").reference,
    )


def test_a_type_of_ones_own_has_one_label() -> None:
    assert add("one", "cut_in").type_label == "Cut in"
    assert add("two", "ghost-driver", "Wrong-way driver").get_type_display() == "Wrong-way driver"
    assert add("three", "ghost-driver").type_label == "Wrong-way driver"
    with pytest.raises(Conflict, match="is called 'Wrong-way driver' already"):
        add("four", "ghost-driver", "Ghost")
    with pytest.raises(Conflict, match="Another scenario type, 'cut_in'"):
        add("four", "cutting_in", "Cut in")
    with pytest.raises(Conflict, match="'jaywalking_pedestrian', is called"):
        add("four", "walker", "Jaywalker")
    with pytest.raises(InvalidDocument, match="has a label of its own"):
        add("four", "jaywalking_pedestrian", "Walker")
    assert [name for name, _ in type_choices()][5:] == ["cut_in", "ghost-driver"]
    assert (type_label("cut_in"), type_label("nobody-knows")) == ("Cut in", "nobody-knows")


@pytest.mark.parametrize("slug", ["", "Cut", "cut in", "cut__in", "-cut", "c" * 41])
def test_a_type_is_a_slug(slug: str) -> None:
    with pytest.raises(InvalidDocument, match="slug of your own"):
        add("one", slug)
