"""Slugs made of names."""

import pytest

from augment.models import Contestant
from augment.services.texts import check_slug, free_slug

pytestmark = pytest.mark.django_db


def test_a_name_in_any_script_makes_a_slug_that_nobody_has() -> None:
    for taken in ("taken", "taken-2", "taken-over"):
        Contestant.objects.create(slug=taken, name=taken, kind=Contestant.Kind.HUMAN)
    for name, slug in (
        ("gpt-4.1 otm", "gpt-4-1-otm"),
        ("Kreuzung  Süd_2", "kreuzung-sud-2"),
        ("路口", "someone"),
        ("  ", "someone"),
        ("Taken", "taken-3"),
        ("x" * 200, "x" * 72),
    ):
        assert free_slug(Contestant.objects, name, otherwise="someone") == slug
        check_slug(slug, what="contestant")
