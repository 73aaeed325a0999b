"""Scenarios of a job or a study as one zip: files, and a manifest of what they are and lost."""

from __future__ import annotations

import json
import platform
from dataclasses import asdict
from importlib import metadata

from arena.exports.files import zip_bytes
from arena.results.services.vote_files import digest_of
from augment.services.judging.scenario_export import Exported

MANIFEST = "manifest.json"
WARNING = "WARNING.txt"
WRITTEN_WITH = ("numpy", "scenariogeneration", "shapely", "PyYAML")
"""What the bytes of the files depend on besides our own code."""


def scenario_zip(exported: Exported) -> bytes:
    """The zip; the same rows always give the same bytes."""
    files = dict(exported.written.files)
    if exported.warnings:
        files[WARNING] = ("\n".join(exported.warnings) + "\n").encode()
    files[MANIFEST] = _manifest(exported, files)
    return zip_bytes(files)


def zip_name(exported: Exported, slug: str) -> str:
    """What the zip is called; data that must not be used commercially is marked in the name."""
    marked = any(source.is_non_commercial for source in exported.sources)
    return f"{slug}-{exported.format}{'-non-commercial' if marked else ''}.zip"


# --- Private -----------------------------------------------------------------------------------


def _manifest(exported: Exported, files: dict[str, bytes]) -> bytes:
    written = exported.written
    document = {
        "format": "scenario-arena/scenarios",
        "version": 1,
        exported.origin.kind: {"name": exported.origin.name, "code": exported.origin.code},
        "scenarios_in": exported.format,
        "warnings": list(exported.warnings),
        "sources": [asdict(source) for source in exported.sources],
        "lost": [asdict(loss) for loss in written.losses],
        "refused": [asdict(loss) for loss in written.refused],
        "missing": [asdict(loss) for loss in exported.missing],
        "versions": {"python": platform.python_version()}
        | {name: metadata.version(name) for name in WRITTEN_WITH},
        "files": {
            name: {"sha256": digest_of(content), "bytes": len(content)}
            for name, content in sorted(files.items())
        },
    }
    return (json.dumps(document, indent=2, ensure_ascii=False, sort_keys=True) + "\n").encode()
