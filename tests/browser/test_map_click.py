"""A click on a map's picture puts the ego on the nearest lane."""

from urllib.parse import parse_qs

import pytest
from django.urls import reverse
from playwright.sync_api import Browser

from augment.models import SceneUpload, UploadMoment
from tests.browser.held import hold
from tests.web.cast import people, png, signed_in

pytestmark = [pytest.mark.browser, pytest.mark.django_db]

PLACES = {"1,-1": [[10.0, 100.0, 450.0], [12.0, 110.0, 450.0]], "1,1": [[10.0, 100.0, 415.0]]}


def test_a_click_sends_the_nearest_place_and_none_far_from_every_lane(browser: Browser) -> None:
    item = "@1,1,50"
    stop = {"item": item, "frame": 0, "time_s": None}
    upload = SceneUpload.objects.create(
        name="roads.xodr",
        size_bytes=1,
        state="read",
        format="opendrive",
        tracks=[{"name": item, "stops": [stop]}],
    )
    UploadMoment.objects.create(
        upload=upload, item=item, state="drawn", picture="map.png", report={"places": PLACES}
    )
    path = reverse("upload", args=[upload.code])
    html = signed_in(people()["researcher"]).get(path).content
    picture = png(width=1200, height=900)
    with hold(browser, path, html) as held:
        held.page.route(
            "**/pictures/**", lambda route: route.fulfill(body=picture, content_type="image/png")
        )
        held.page.reload()
        shown = held.page.locator("#chosen")
        held.page.wait_for_function("document.getElementById('chosen').naturalWidth === 1200")
        shown.evaluate("image => image.scrollIntoView()")
        box = shown.bounding_box()
        assert box is not None
        for x, y in ((600, 450), (108, 445)):
            scale = box["width"] / 1200
            held.page.mouse.click(box["x"] + x * scale, box["y"] + y * scale)
        sent = parse_qs(held.post(0).request.post_data or "")
        assert (sent["place"], sent["put"]) == (["1,-1,12"], ["1"])
        assert len(held.posted) == 1
