"""What the checks found, numbered in a picture of its own, for staff alone."""

from collections.abc import Callable
from pathlib import Path

import pytest
from django.conf import LazySettings
from django.core.files.storage import default_storage
from django.urls import reverse

from augment.models import Augmentation
from augment.scene.codec import intent_to_document
from augment.services.judging.findings import check_augmentation, draw_marked
from tests.intents import parked
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

OnCommit = Callable[..., object]
FAR = intent_to_document(parked(40.0))


@pytest.fixture(autouse=True)
def _media(settings: LazySettings, tmp_path: Path) -> None:
    settings.MEDIA_ROOT = tmp_path


@pytest.fixture
def row() -> Augmentation:
    """Two cones where a parked car is asked for."""
    found = rows.only_row(rows.launch())
    rows.leased(found).settle(rows.done(), now=rows.NOON)
    found.scenario.intent = FAR
    found.scenario.save(update_fields=["intent"])
    return Augmentation.objects.select_related("contestant", "scenario__base_scene").get()


def test_the_page_has_the_picture_drawn_and_shows_it_with_the_same_numbers(
    row: Augmentation, django_capture_on_commit_callbacks: OnCommit
) -> None:
    researcher, url = signed_in(people()["researcher"]), reverse("augmentation", args=[row.code])
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        before = researcher.get(url).content.decode()
    assert len(waiting) == 1
    assert "A worker is drawing the marks." in before
    assert 'content="2; url=?look=1"' in before
    name = draw_marked(augmentation_pk=row.pk)
    assert default_storage.exists(name)
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        after = researcher.get(url).content.decode()
    assert not waiting
    picture = reverse("picture", args=["marked", row.code])
    assert picture in after
    assert "http-equiv" not in after
    found = check_augmentation(row)
    assert found is not None
    assert after.count('class="number ') == len(found.faults) >= 2
    assert [line.kind for line in found.faults][:2] == ["asked_count", "asked_type"]
    shown = researcher.get(picture)
    assert shown.getvalue()[:4] == b"\x89PNG"
    shown.close()


def test_no_expert_sees_it(row: Augmentation) -> None:
    draw_marked(augmentation_pk=row.pk)
    expert = signed_in(people()["expert"])
    assert expert.get(reverse("picture", args=["marked", row.code])).status_code == 403
