from __future__ import annotations

import hashlib
from dataclasses import replace

from augment.llm.messages import Message, Request, Speaker, image_reference, request_hash

ASKED = Request(
    model="m",
    messages=(Message(speaker=Speaker.USER, text="Look.", images=(b"png",)),),
    max_tokens=10,
    temperature=0.5,
    seed=1,
)


def hash_of(
    request: Request = ASKED, *, base_url: str = "http://a/v1", version: str = "p1"
) -> str:
    document = request.to_document(image_url=image_reference)
    return request_hash(base_url=base_url, document=document, prompt_version=version)


def test_an_image_is_named_by_its_bytes_and_not_carried_along() -> None:
    document = ASKED.to_document(image_url=image_reference)
    assert hashlib.sha256(b"png").hexdigest() in str(document)
    assert "base64" not in str(document)


def test_the_same_request_has_the_same_hash() -> None:
    assert hash_of() == hash_of() == hash_of(base_url="http://a/v1/")
    assert len(hash_of()) == 64


def test_everything_that_an_answer_depends_on_changes_the_hash() -> None:
    message = ASKED.messages[0]
    others = [
        hash_of(base_url="http://b/v1"),
        hash_of(version="p2"),
        hash_of(replace(ASKED, model="n")),
        hash_of(replace(ASKED, max_tokens=11)),
        hash_of(replace(ASKED, temperature=None)),
        hash_of(replace(ASKED, seed=2)),
        hash_of(replace(ASKED, messages=(replace(message, text="Look!"),))),
        hash_of(replace(ASKED, messages=(replace(message, images=(b"other",)),))),
        hash_of(replace(ASKED, messages=(replace(message, speaker=Speaker.SYSTEM),))),
    ]
    assert len({hash_of(), *others}) == 1 + len(others)
