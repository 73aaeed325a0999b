"""What an expert's browser gets, and everything in it that tells who made a picture.

`leaks` is the suite's one judge: it looks at addresses, headers, pages, JSON and the chunks and
sizes of pictures. The tests run it on the product, and on a product in which a leak is planted.
"""

import json
import re
import struct
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from html import unescape
from typing import Any
from urllib.parse import urldefrag, urljoin, urlsplit

from django.http.response import HttpResponseBase
from django.test import Client
from django.urls import URLPattern, URLResolver, get_resolver

from arena.models import Study
from augment.models import Augmentation

LINK = re.compile(rb"""(?:href|src|action|srcset)=["']([^"'#][^"']*)["']""")
SCRIPT = re.compile(rb'<script[^>]*type="application/json"[^>]*>(.*?)</script>', re.S)
CHUNKS = {"IHDR", "PLTE", "tRNS", "IDAT", "IEND"}
TELLING_HEADERS = ("ETag", "Last-Modified", "Content-Disposition")
MATCHUP = {
    *("matchup", "position", "instruction", "a", "b", "original"),
    *("px_per_m", "ego_px", "width", "height", "legend", "unchanged", "question", "is_filmed"),
}
"""All that a matchup may say on the wire."""
REPLY = {
    *("saved", "skipped", "total", "next"),
    *("error", "code", "message", "fields", "outcome"),
}
"""All that may stand around it in a reply of the API."""
OWN = {
    *("results", "name", "state", "planned", "voted", "skipped", "left"),
    *("opened_at", "closed_at", "labelled", "task", "picture", "original"),
}
"""What an expert is told of their studies and of what they label."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What came back from one address."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def is_picture(self) -> bool:
        return self.headers.get("Content-Type", "") == "image/png"

    @property
    def is_json(self) -> bool:
        return self.headers.get("Content-Type", "").startswith("application/json")


Seen = dict[str, Answer]
PARTS = {
    **{"form": "csv", "tab": "pairs", "side": "left", "kind": "augmentation"},
    **{"name": "leaderboard", "part": "pairs", "digest": "0" * 64, "key": "0" * 16},
}
"""What stands for the parameters of an address that are no code, token or number."""


def every_view(
    entries: list[URLPattern | URLResolver] | None = None, before: str = "/"
) -> Iterator[tuple[str, str]]:
    """Yield the name and the address of each view of the product, with its parameters open."""
    for entry in get_resolver().url_patterns if entries is None else entries:
        here = before + str(entry.pattern)
        if isinstance(entry, URLResolver):
            yield from every_view(entry.url_patterns, here)
        else:
            yield entry.name or "", here


def fill(address: str, code: str, token: str) -> str:
    """Return an open address about the row with a code; a parameter that is new needs a part."""
    parts = PARTS | {"token": token}

    def value(found: re.Match[str]) -> str:
        return {"uuid": code, "int": "0"}.get(found[1]) or parts[found[2]]

    return re.sub(r"<(\w+):(\w+)>", value, address)


def answer_of(response: HttpResponseBase) -> Answer:
    body = response.getvalue()
    return Answer(status=response.status_code, headers=dict(response.items()), body=body)


def crawl(client: Client, starts: list[str]) -> Seen:
    """Every address that can be reached by links from the starts, in pages and in JSON."""
    seen: Seen = {}
    waiting = list(starts)
    while waiting:
        address = waiting.pop()
        if address in seen or address.startswith(("/logout", "/static/")):
            continue
        found = answer_of(client.get(address))
        seen[address] = found
        links = (
            [] if found.is_picture else [unescape(x.decode()) for x in LINK.findall(found.body)]
        )
        links += [found.headers["Location"]] if "Location" in found.headers else []
        links += [text for value in documents(found) for text in addresses_in(value)]
        for link in links:
            target = urldefrag(urljoin(address, link)).url
            if not urlsplit(target).netloc:
                waiting.append(target)
    return seen


def vote_through(client: Client, study: Study) -> Seen:
    """Every reply of the wire while an expert votes to the end, and every picture it names."""
    replies: Seen = {}
    asked = f"/api/v1/matchups?study={study.code}&n=4"
    waiting = json.loads(client.get(asked).content)
    while waiting:
        given = waiting[0]
        replies.update(
            crawl(client, [given[side] for side in ("a", "b", "original") if given.get(side)])
        )
        body = {"key": str(uuid.uuid4()), "matchup": given["matchup"], "outcome": "E"}
        response = client.post("/api/v1/votes", body, content_type="application/json")
        replies[f"/api/v1/votes#{given['position']}"] = answer_of(response)
        assert response.status_code == 200, response.content
        waiting = response.json()["next"]
    return replies


def secrets_of(study: Study) -> list[str]:
    """Everything that tells who made a picture, or which pictures were made together."""
    told = ["llama", "otm", "hosted"]
    for contestant in study.contestants.all():
        told += [contestant.slug, contestant.name, str(contestant.code)]
        card = contestant.card or {}
        told += [card.get("name", ""), card.get("method", ""), *card.get("models", ())]
    for row in Augmentation.objects.select_related("job"):
        told += [str(row.code), str(row.job.code), row.image, row.image.split("/")[-1]]
        told += [agent["id"] for agent in (row.modification or {}).get("add", ())]
    return [secret for secret in told if secret]


def leaks(study: Study, seen: Seen, *, guessed: bool = False) -> list[str]:
    """Every leak that was found, as a sentence.

    Args:
        study: Whose contestants nobody may recognise.
        seen: What the expert's browser got.
        guessed: The addresses are the guesser's own: that one comes back tells nothing.
    """
    found = word_leaks(study, seen, guessed=guessed) + field_leaks(seen)
    for address, answer in seen.items():
        if answer.is_picture:
            found += [f"{address} {what}" for what in picture_leaks(answer)]
    return found + size_leaks(seen)


def word_leaks(study: Study, seen: Seen, *, guessed: bool = False) -> list[str]:
    """Names, codes and file names in pages, replies, headers and addresses."""
    found = []
    secrets = [
        (s, re.compile(rb"(?<![a-z0-9])%b(?![a-z0-9])" % re.escape(s.lower().encode())))
        for s in secrets_of(study)
    ]
    for address, answer in seen.items():
        headers = "\n".join(f"{name}: {value}" for name, value in answer.headers.items())
        told = headers if guessed else headers + "\n" + address
        body = b"" if answer.is_picture else answer.body
        text = told.lower().encode() + b"\n" + body.lower()
        found += [
            f"{address} tells {secret!r}"
            for secret, word in secrets
            if not (guessed and secret in address) and word.search(text)
        ]
    return found


def field_leaks(seen: Seen) -> list[str]:
    """Fields of a matchup or a reply that nobody allowed."""
    found = []
    for address, answer in seen.items():
        allowed = MATCHUP | REPLY | OWN if answer.is_json else MATCHUP
        for value in documents(answer):
            for mapping in mappings_in(value):
                if answer.is_json or "matchup" in mapping:
                    found += [
                        f"{address} has a field {n!r}" for n in sorted(set(mapping) - allowed)
                    ]
    return found


def picture_leaks(answer: Answer) -> list[str]:
    """What a picture's headers and chunks tell beside its pixels."""
    found = [f"has a header {name}" for name in TELLING_HEADERS[:2] if name in answer.headers]
    if answer.headers.get("Content-Disposition", "inline") != "inline":
        found.append("names a file")
    cache = set(answer.headers.get("Cache-Control", "").replace(",", " ").split())
    if "private" not in cache or "public" in cache:
        found.append("may be kept by others than the browser")
    kinds = list(chunks(answer.body))
    found += [f"has a chunk {kind}" for kind in kinds if kind not in CHUNKS]
    if not kinds or kinds[-1] != "IEND":
        found.append("goes on after its end")
    return found


def size_leaks(seen: Seen) -> list[str]:
    """Pairs whose pictures differ in size, from what they say and from their pixels."""
    sizes = {
        address: size_of(answer.body)
        for address, answer in seen.items()
        if answer.is_picture and answer.status == 200
    }
    found = []
    for address, answer in seen.items():
        for value in documents(answer):
            for given in mappings_in(value):
                if "matchup" not in given or isinstance(given["matchup"], dict):
                    continue
                told = {(given["width"], given["height"])} if "width" in given else set()
                shown = {sizes[given[s]] for s in ("a", "b", "original") if given.get(s) in sizes}
                # A picture has two pixels each way for one that is told.
                twice = {(2 * width, 2 * height) for width, height in told}
                if len(shown) > 1 or (shown and told and shown not in (told, twice)):
                    found.append(f"{address} shows sizes that differ: {sorted(shown | told)}")
    return found


def chunks(png: bytes) -> Iterator[str]:
    """The kinds of the chunks in their order; "rest" for bytes that are in none."""
    at = 8
    while at + 12 <= len(png):
        length, kind = struct.unpack(">I4s", png[at : at + 8])
        yield kind.decode("latin-1")
        at += 12 + length
    if at != len(png):
        yield "rest"


def size_of(png: bytes) -> tuple[int, int]:
    width, height = struct.unpack(">II", png[16:24])
    return width, height


def documents(answer: Answer) -> list[Any]:
    """Every JSON document in an answer: the whole of it, or what a page carries for its script."""
    if answer.is_json:
        return [json.loads(answer.body)]
    return [json.loads(found) for found in SCRIPT.findall(answer.body)]


def mappings_in(value: Any) -> Iterator[dict[str, Any]]:
    if isinstance(value, dict):
        yield value
        # The fields of an error are the asker's own words.
        children = [child for name, child in value.items() if name != "fields"]
    else:
        children = value if isinstance(value, list) else []
    for child in children:
        yield from mappings_in(child)


def addresses_in(value: Any) -> Iterator[str]:
    for mapping in mappings_in(value):
        for text in mapping.values():
            if isinstance(text, str) and text.startswith("/"):
                yield text
