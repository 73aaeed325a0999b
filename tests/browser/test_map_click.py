"""A click on a map's picture puts the ego on the nearest lane."""

from urllib.parse import parse_qs

import pytest
from django.urls import reverse
from playwright.sync_api import Browser, expect

from augment.models import SceneUpload, UploadMoment
from tests.browser.held import hold
from tests.web.cast import people, png, signed_in

pytestmark = [pytest.mark.browser, pytest.mark.django_db]

PLACES = {"1,-1": [[10.0, 100.0, 450.0], [12.0, 110.0, 450.0]], "1,1": [[10.0, 100.0, 415.0]]}


def test_a_click_sends_the_nearest_place_and_none_far_from_every_lane(browser: Browser) -> None:
    path = reverse("upload", args=[upload_of("@1,1,50").code])
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


def test_another_moment_brings_its_own_place(browser: Browser) -> None:
    upload = upload_of("@1,1,50", "@1,-1,10")
    path, researcher = reverse("upload", args=[upload.code]), signed_in(people()["researcher"])
    pages = [
        researcher.get(f"{path}?moment={moment.code}").content.decode()
        for moment in upload.moments.order_by("pk")
    ]
    with hold(browser, path, pages[0].encode()) as held:
        held.page.route("**/*moment=*", lambda route: route.fulfill(body=pages[1]))
        place = held.page.locator("#place")
        expect(place).to_have_value("1,1,50")
        held.page.locator("[name=stop]:not(:checked)").first.check()
        expect(place).to_have_value("1,-1,10")


# --- Private -----------------------------------------------------------------------------------


def upload_of(*items: str) -> SceneUpload:
    """A map of which each place has been drawn."""
    stops = [{"item": item, "frame": 0, "time_s": None} for item in items]
    upload = SceneUpload.objects.create(
        name="roads.xodr",
        size_bytes=1,
        state="read",
        format="opendrive",
        tracks=[{"name": items[0], "stops": stops}],
    )
    for item in items:
        UploadMoment.objects.create(
            upload=upload, item=item, state="drawn", picture="map.png", report={"places": PLACES}
        )
    return upload
