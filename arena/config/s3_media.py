"""Pictures in a bucket that speaks S3, so that workers and web servers need no common folder."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from functools import wraps
from typing import Any

from boto3.exceptions import Boto3Error
from botocore.config import Config
from botocore.exceptions import BotoCoreError, ClientError
from django.core.files.base import ContentFile, File
from storages.backends.s3 import S3Storage

from augment.errors import MediaFault

logger = logging.getLogger(__name__)

CLIENT = Config(
    signature_version="s3v4",
    s3={"addressing_style": "path"},  # what MinIO, Ceph, Garage and AWS all understand
    connect_timeout=5,
    read_timeout=30,
    retries={"mode": "standard", "total_max_attempts": 4},
)
"""Standard retries wait longer each time: a bucket that is gone for a moment costs no picture."""


def _describe_fault(deed: str, method: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(method)
    def call(self: S3Media, name: str) -> Any:
        with self._faults_named(deed, name):
            return method(self, name)

    return call


class S3Media(S3Storage):  # type: ignore[misc] # it has no types
    """Files of a bucket. An object is there whole or not at all, and the last writer wins.

    Nobody reads the bucket but the product: pages hand pictures out themselves, to whom they are
    to be shown. What a bucket answers to a fault becomes a MediaFault, as a folder's does.
    """

    def __init__(self, **options: Any) -> None:
        """Take bucket_name, location, endpoint_url and region_name; the keys stand in AWS_..."""
        super().__init__(
            file_overwrite=True,
            default_acl=None,
            querystring_auth=True,
            client_config=CLIENT,
            **options,
        )

    exists = _describe_fault("look for", S3Storage.exists)
    size = _describe_fault("look for", S3Storage.size)
    delete = _describe_fault("delete", S3Storage.delete)
    listdir = _describe_fault("list", S3Storage.listdir)

    def find_older(self, folder: str, before: datetime) -> list[str]:
        """Return the files of a folder of before that time; a request for each thousand of all."""
        with self._faults_named("list", folder):
            there = self.bucket.objects.filter(Prefix=f"{self._normalize_name(folder)}/")
            names = [row.key.rpartition("/")[2] for row in there if row.last_modified < before]
        return [f"{folder}/{name}" for name in names]

    def _open(self, name: str, mode: str = "rb") -> File[bytes]:
        if mode != "rb":
            raise ValueError(f"Files in a bucket are opened with 'rb', not {mode!r}.")
        # Read at once: a fault while a page is being sent could only cut the page off.
        with self._faults_named("read", name), super()._open(name, mode) as file:
            return ContentFile(file.read(), name=name)

    def _save(self, name: str, content: File[bytes]) -> str:
        with self._faults_named("write", name):
            return str(super()._save(name, content))

    @contextmanager
    def _faults_named(self, deed: str, name: str) -> Iterator[None]:
        try:
            yield
        except (BotoCoreError, ClientError, Boto3Error) as fault:
            place = f"s3://{self.bucket_name}/{self.location}".rstrip("/")
            logger.error("Could not %s %s in %s: %s", deed, name or "anything", place, fault)
            raise MediaFault(deed, place, _fault_code(fault)) from fault


def _fault_code(fault: Exception) -> str:
    """In a word: the code that the bucket answered, or what kept an answer away."""
    first = fault.__cause__ if isinstance(fault, Boto3Error) and fault.__cause__ else fault
    if isinstance(first, ClientError):
        return str(first.response.get("Error", {}).get("Code", "refused"))
    return type(first).__name__
