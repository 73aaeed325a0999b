"""Where the seeds of runs come from."""

from __future__ import annotations

import hashlib


def seed_of(slug: str) -> int:
    """The seed of a scenario: the same in every job, another for every slug."""
    return int.from_bytes(hashlib.sha256(slug.encode()).digest()[:4], "big")
