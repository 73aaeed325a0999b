"""Who and what the tests of pages look at: one account per role, a job, studies, a picture."""

import re
import struct
import zlib
from dataclasses import dataclass
from typing import Any

from django.contrib.auth.models import User
from django.test import Client

from arena.models import Study
from arena.people.services import create_person
from augment.models import Augmentation, GenerationJob
from augment.services.scenarios.pictures import store
from tests import study_rows
from tests.jobs import rows

ROLES = ("admin", "researcher", "expert")


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """A study with pictures, open; a job; and somebody of each role who takes part in nothing."""

    study: Study
    job: GenerationJob
    augmentation: Augmentation
    expert: User


def png(shade: int = 0, *, width: int = 1, height: int = 1) -> bytes:
    """A grey picture, of one pixel unless told otherwise."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    body = zlib.compress((b"\0" + bytes([shade]) * width) * height, 1)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def people() -> dict[str, User]:
    """One account per role; the password of all is "a password"."""
    return {
        role: create_person(username=f"the-{role}", password="a password", role=role)
        for role in ROLES
    }


class PageClient(Client):
    """A client whose pages have no layout: how a template is indented means nothing to a test."""

    def request(self, **request: Any) -> Any:
        answer = super().request(**request)
        is_page = answer.headers.get("Content-Type", "").startswith("text/html")
        if is_page and not answer.streaming:
            answer.content = collapse_spaces(answer.content.decode()).encode()
        return answer


def collapse_spaces(page: str) -> str:
    """Drop what a browser does not show: runs of spaces, and those at the edges of blocks."""
    kept, laid_out = _VERBATIM.findall(page), _VERBATIM.split(page)
    for number, part in enumerate(laid_out):
        laid_out[number] = _BLOCK_EDGE.sub(
            r"\1", _VALUE_OR_SPACES.sub(lambda found: found[1] or " ", part)
        )
    return "".join(a + b for a, b in zip(laid_out, [*kept, ""], strict=True))


_VALUE_OR_SPACES = re.compile(r"(=\"[^\"]*\")|\s+")  # spaces within a value stay
_VERBATIM = re.compile(r"(?s:<(?:pre|textarea|script)\b.*?</(?:pre|textarea|script)>)")
_BLOCK_EDGE = re.compile(
    r" ?(</?(?:article|dd|details|div|dl|dt|figure|form|h[1-4]|li|main|ol|option|p|section|"
    r"summary|table|tbody|td|th|thead|title|tr|ul)\b[^>]*>) ?"
)


def signed_in(user: User) -> Client:
    client = PageClient()
    client.force_login(user)
    return client


def look(client: Client, url: str) -> int:
    """What a GET answers; a picture is read to its end, which closes its file."""
    answer = client.get(url)
    if answer.streaming:
        b"".join(answer)
    return answer.status_code


def world() -> World:
    """Six scenarios by three contestants; two experts, eva and finn, with nine matchups each."""
    study = study_rows.a_study()
    for number, augmentation in enumerate(Augmentation.objects.all()):
        study_rows.hang(augmentation, store(png(number)))
    job = rows.launch(scenarios=2, contestants=("reference",))
    return World(
        study=study,
        job=job,
        augmentation=job.augmentations.first() or Augmentation(),
        expert=User.objects.get(username="eva"),
    )
