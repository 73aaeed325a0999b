"""Choosing a moment of a recording: the last wish counts, whichever answer comes first."""

import json

import pytest
from django.core.files.uploadedfile import SimpleUploadedFile
from django.urls import reverse
from playwright.sync_api import Browser, expect

from augment.models import SceneUpload
from augment.scene.codec import scene_to_document
from augment.services.scenarios import uploads
from tests.browser.held import hold
from tests.scenes import scene
from tests.web.cast import people, signed_in

pytestmark = [pytest.mark.browser, pytest.mark.django_db]


def shown(what: str) -> str:
    return f'<main id="main"><section class="card" id="moment">{what}</section></main>'


def test_an_older_moment_never_takes_the_place_of_a_newer_one(browser: Browser) -> None:
    street = json.dumps(scene_to_document(scene())).encode()
    row = uploads.keep_upload(name="street.json", content=SimpleUploadedFile("street", street))
    uploads.UPLOADS.perform(row.pk)
    row = SceneUpload.objects.get()
    row.tracks[0]["stops"] *= 3
    row.save()
    path = reverse("upload", args=[row.code])
    html = signed_in(people()["researcher"]).get(path).content
    with hold(browser, path, html) as held:
        button = held.page.get_by_role("button", name="Show")
        button.click()
        held.post(0)
        button.click()
        held.post(1).fulfill(body=shown("the newer"), content_type="text/html")
        moment = held.page.locator("#moment")
        expect(moment).to_have_text("the newer")
        held.post(0).fulfill(body=shown("the older"), content_type="text/html")
        held.page.wait_for_load_state("networkidle")
        expect(held.page.locator(".timeline[aria-busy]")).to_have_count(0)
        expect(moment).to_have_text("the newer")
