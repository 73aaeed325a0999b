"""Receipts of POSTs: one with a key is carried out once, and answered the same way again.

The key is the token of a form as it was shown, or a program's `Idempotency-Key`. A receipt stands
before the request is carried out; who comes meanwhile waits for the answer of the first.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from hashlib import sha256, shake_256
from typing import TypeVar

from django.core.files.uploadedfile import UploadedFile
from django.db import IntegrityError
from django.db.models import Q
from django.utils.crypto import salted_hmac
from django.utils.datastructures import MultiValueDict

from arena.errors import KeyReused, StillUnderWay
from arena.models import Receipt
from augment.services import DATABASE_TIME

Answer = TypeVar("Answer")

KEPT_FOR = timedelta(days=1)
LOST_AFTER = timedelta(minutes=15)
"""A request without an answer for so long died with its web server; it may be sent anew."""

WAIT_S, LOOK_EVERY_S = 20.0, 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredAnswer:
    """The answer that the first request with a key had.

    Attributes:
        status: Of HTTP.
        content: As `pack` made it.
        is_late: Whether it was there before this request came.
    """

    status: int
    content: bytes
    is_late: bool


def answer_once(
    key: str,
    body: str,
    act: Callable[[], Answer],
    pack: Callable[[Answer], tuple[int, bytes] | None],
) -> Answer | StoredAnswer:
    """Carry out a request, or return the answer that the first one with its key had.

    Args:
        key: Whose and which it is.
        body: The digest of what was sent.
        act: Carries it out.
        pack: Returns the status and content of an answer; None where nothing was made by it, so
            that it may be sent again.

    Raises:
        KeyReused: The key came with another body.
        StillUnderWay: The first one has had no answer for WAIT_S.
    """
    is_lost = Q(status=None, received_at__lt=DATABASE_TIME - LOST_AFTER)
    Receipt.objects.filter(is_lost | Q(received_at__lt=DATABASE_TIME - KEPT_FOR)).delete()
    first = {"body_hash": body, "received_at": DATABASE_TIME}
    give_up_at, is_late = time.monotonic() + WAIT_S, True
    while True:
        try:
            receipt, is_new = Receipt.objects.get_or_create(key_hash=_digest(key), defaults=first)
        except IntegrityError:  # the first was refused at this moment
            continue
        if is_new:
            break
        if receipt.body_hash != body:
            raise KeyReused
        if receipt.status is not None:
            content = _seal(bytes(receipt.answer), key, receipt)
            return StoredAnswer(status=receipt.status, content=content, is_late=is_late)
        if time.monotonic() > give_up_at:
            raise StillUnderWay
        is_late = False
        time.sleep(LOOK_EVERY_S)
    packed = None
    try:
        answer = act()
        packed = pack(answer)
    finally:
        if packed is None:
            receipt.delete()
    if packed is not None:
        receipt.status, receipt.answer = packed[0], _seal(packed[1], key, receipt)
        receipt.save(update_fields=["status", "answer"])
    return answer


def digest_body(body: object) -> str:
    """Return the hash of a body: JSON, or the fields and files of a form.

    It depends on the secret key, so that a key sent again after a change of that is refused: the
    answer can't be opened any more.
    """
    fields = dict(body.lists()) if isinstance(body, MultiValueDict) else body
    text = json.dumps(fields, sort_keys=True, default=_describe)
    return salted_hmac("arena.receipt", text, algorithm="sha256").hexdigest()


# --- Private -----------------------------------------------------------------------------------


def _digest(text: str) -> str:
    return sha256(text.encode()).hexdigest()


def _describe(value: object) -> str:
    """Return a text for a value that JSON has not: of a file its content's hash."""
    if not isinstance(value, UploadedFile):
        return str(value)
    content = sha256()
    for chunk in value.chunks():
        content.update(chunk)
    value.seek(0)
    return f"{value.name} {content.hexdigest()}"


def _seal(content: bytes, key: str, receipt: Receipt) -> bytes:
    """Seal an answer, or open it: links and tokens in it can't be read without the key."""
    secret = salted_hmac("arena.receipt", f"{receipt.pk} {key}", algorithm="sha256").digest()
    pad = shake_256(secret).digest(len(content))
    return bytes(a ^ b for a, b in zip(content, pad, strict=True))
