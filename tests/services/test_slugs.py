"""Slugs made of names."""

import pytest

from augment.models import Contestant
from augment.services.texts import check_slug, free_slug

pytestmark = pytest.mark.django_db


@pytest.mark.parametrize(
    ("name", "slug"),
    [
        ("gpt-4.1 otm", "gpt-4-1-otm"),
        ("Kreuzung  Süd_2", "kreuzung-sud-2"),
        ("路口", "someone"),
        ("  ", "someone"),
        ("Taken", "taken-3"),
        ("x" * 200, "x" * 72),
    ],
)
def test_a_name_in_any_script_makes_a_slug_that_nobody_has(name: str, slug: str) -> None:
    for taken in ("taken", "taken-2", "taken-over"):
        Contestant.objects.create(slug=taken, name=taken, kind=Contestant.Kind.HUMAN)
    assert free_slug(Contestant.objects, name, otherwise="someone") == slug
    check_slug(slug, what="contestant")
