"""The page that shows what a variant would send, held against what the wire then carries."""

import html
import json
import re
from collections.abc import Iterator

import pytest
from django.test import Client
from django.urls import reverse

from augment.models import ModelCall
from augment.services.scenarios.prompts import preview_prompt
from tests.jobs.rows import add_scenario
from tests.jobs.scripted import Scripted, add, run
from tests.llm.json_server import serving
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def server() -> Iterator[Scripted]:
    with serving(Scripted()) as started:
        yield started


@pytest.fixture
def researcher() -> Client:
    return signed_in(people()["researcher"])


@pytest.mark.parametrize(
    ("variant", "options"),
    [
        *(("otm", {}), ("tqa", {}), ("fc", {}), ("fc", {"protocol": "native"})),
        *(("fc-plus", {}), ("fc-plus", {"protocol": "native"})),
    ],
)
def test_the_page_shows_what_the_wire_then_carries(
    researcher: Client, server: Scripted, variant: str, options: dict[str, object]
) -> None:
    add(server, "asked", variant, **options)
    [row] = run("asked")
    asked = {"variant": variant} | ({"native": "1"} if options else {})
    sent = server.bodies[0]
    preview = preview_prompt(
        row.scenario, variant=variant, role="modifier", native_tools=bool(options)
    )
    assert [json.loads(tool) for tool in preview.tools] == sent.get("tools", [])
    page = researcher.get(reverse("prompts", args=[row.scenario.code]), asked).content.decode()
    shown = [
        html.unescape(one) for one in re.findall(r"<pre data-message[^>]*>(.*?)</pre>", page, re.S)
    ]
    assert shown == [message["content"] for message in sent["messages"]]
    assert re.search(r"About [\d,]+ tokens of text", page)


def test_a_viewer_s_picture_is_shown_and_nobody_is_asked(researcher: Client) -> None:
    here = add_scenario("street")
    asked = {"variant": "vqa", "role": "viewer"}
    url = reverse("prompts", args=[here.code])
    shown = researcher.get(url, asked).content.decode()
    assert "In which lane does each blue object stand?" in html.unescape(shown)
    picture = researcher.get(reverse("prompt-image", args=[here.code, 0]), asked)
    assert picture.content.startswith(b"\x89PNG")
    assert not ModelCall.objects.exists()
