"""Pages of contestants: in full, and out of forms once they are retired."""

from __future__ import annotations

import pytest
from django.urls import reverse

from augment.models import Contestant, EndpointModel, Event
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.running.choosing import resolve_contestants
from augment.variants.options import ContestantOptions
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def add(slug: str = "one") -> Contestant:
    ensure_endpoint(label="here", base_url="http://127.0.0.1:1/v1")
    return contestants.add_contestant(
        slug=slug,
        variant="fc+tqa",
        endpoint="here",
        model="m",
        name=slug.upper(),
        options=ContestantOptions(temperature=0.7, rounds=2),
    )


def test_the_page_says_how_it_asks_and_what_is_not_sent() -> None:
    row = add()
    EndpointModel.objects.update(temperature=False)
    admin = signed_in(people()["admin"])
    shown = admin.get(reverse("contestant", args=[row.code])).content.decode()
    for words in (
        "<dt>Temperature</dt><dd>0.7",
        "Not sent: the model of this role does not take it (modifier, reviewer).",
        "<dt>Rounds at most</dt><dd>2</dd>",
        "<dt>Radius</dt><dd>80 m",
        "in the answer",
        "It has not run yet",
    ):
        assert words in shown
    assert "<dt>Seed</dt>" not in shown
    Contestant.objects.update(frozen_options={"seed": 3, "protocol": "native"})
    shown = admin.get(reverse("contestant", args=[row.code])).content.decode()
    assert "Fixed at its first run" in shown
    assert "natively" in shown
    assert "ONE" in admin.get(reverse("contestants")).content.decode()


def test_a_retired_contestant_is_offered_no_more_and_keeps_its_page() -> None:
    row, other = add(), add("two")
    admin = signed_in(people()["admin"])
    admin.post(reverse("contestant-retired", args=[row.code]), {"retired": "yes"})
    for page in ("job-new", "study-new"):
        form = admin.get(reverse(page)).content.decode()
        assert 'name="contestants" value="one"' not in form
        assert 'name="contestants" value="two"' in form
    assert "one" not in resolve_contestants(["all"])
    assert resolve_contestants(["one"]) == ["one"]
    shown = admin.get(reverse("contestants")).content.decode()
    assert shown.index("Retired") < shown.index("ONE")
    assert (
        "forms offer it no more"
        in admin.get(reverse("contestant", args=[row.code])).content.decode()
    )
    admin.post(reverse("contestant-retired", args=[row.code]), {"retired": "no"})
    assert "one" in resolve_contestants(["all"])
    told = set(Event.objects.filter(object_code=row.code).values_list("verb", flat=True))
    assert {"retire", "take back"} <= told
    assert other.retired_at is None
