"""What the checks found, beside a picture with everybody's name."""

import pytest
from django.urls import reverse
from django.utils.html import escape

from augment.models import Augmentation
from augment.scene.codec import intent_to_document
from augment.services.judging.findings import check_augmentation
from tests.intents import parked
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

FAR = intent_to_document(parked(40.0))


@pytest.fixture
def row() -> Augmentation:
    """Two cones where a parked car is asked for."""
    found = rows.only_row(rows.launch())
    rows.leased(found).settle(rows.done(), now=rows.NOON)
    found.scenario.intent = FAR
    found.scenario.save(update_fields=["intent"])
    return Augmentation.objects.select_related("contestant", "scenario__base_scene").get()


def test_the_page_names_everybody_in_a_picture_for_staff_alone(row: Augmentation) -> None:
    staff, url = people(), reverse("augmentation", args=[row.code])
    researcher = signed_in(staff["researcher"])
    page = researcher.get(url).content.decode()
    picture = reverse("picture", args=["labelled", row.code])
    assert picture in page
    found = check_augmentation(row)
    assert found is not None
    assert [line.kind for line in found.faults][:2] == ["asked_count", "asked_type"]
    assert all(escape(line.sentence()) in page for line in found.faults)
    assert researcher.get(picture).content[:4] == b"\x89PNG"
    assert signed_in(staff["expert"]).get(picture).status_code == 403
