"""A server of this machine that speaks S3, with an empty bucket in it."""

import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from unittest import mock
from urllib.request import Request, urlopen

import boto3
from moto.server import ThreadedMotoServer

from tests.stack import free_port

KEYS = {"AWS_ACCESS_KEY_ID": "tests", "AWS_SECRET_ACCESS_KEY": "no secret"}
BUCKET = "pictures"
REGION = "eu-central-1"


@dataclass(slots=True)
class Bucket:
    """Where it is, as a program of ours is told, and what lies in it.

    Stopped and started again it has what it had.
    """

    port: int
    server: ThreadedMotoServer | None = None

    @property
    def endpoint(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        logging.getLogger("werkzeug").setLevel(logging.ERROR)
        self.server = ThreadedMotoServer(ip_address="127.0.0.1", port=self.port, verbose=False)
        self.server.start()

    def stop(self) -> None:
        if self.server is not None:
            self.server.stop()
            self.server = None

    @property
    def environment(self) -> Mapping[str, str]:
        url = f"s3://{BUCKET}/arena?endpoint={self.endpoint}&region={REGION}"
        return {"ARENA_MEDIA_URL": url, **KEYS}

    @property
    def client(self):  # type: ignore[no-untyped-def] # boto3 has no types
        return boto3.client(
            "s3",
            endpoint_url=self.endpoint,
            region_name=REGION,
            aws_access_key_id=KEYS["AWS_ACCESS_KEY_ID"],
            aws_secret_access_key=KEYS["AWS_SECRET_ACCESS_KEY"],
        )

    def names(self) -> list[str]:
        listed = self.client.list_objects_v2(Bucket=BUCKET).get("Contents", [])
        return sorted(entry["Key"] for entry in listed)

    def clear(self) -> None:
        """Delete all that lies in it."""
        for name in self.names():
            self.client.delete_object(Bucket=BUCKET, Key=name)


@contextmanager
def bucket() -> Iterator[Bucket]:
    """One that is gone, with all that lay in it, when the block is left."""
    with mock.patch.dict(os.environ, KEYS):
        made = Bucket(free_port())
        made.start()
        try:
            # All servers of a process share what they keep.
            urlopen(Request(f"{made.endpoint}/moto-api/reset", method="POST"), timeout=30).close()
            made.client.create_bucket(
                Bucket=BUCKET, CreateBucketConfiguration={"LocationConstraint": REGION}
            )
            yield made
        finally:
            made.stop()
