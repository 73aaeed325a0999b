"""A simulated study, rated and stored by the code of version 1, with the hashes of its files."""

import json
from pathlib import Path
from typing import Any

from django.db import connection

from arena.models import Snapshot, Standing, Study
from arena.rating.snapshot_document import Results

OLD: dict[str, Any] = json.loads((Path(__file__).parent / "version_1.json").read_text())


def stored(results: dict[str, Any]) -> Snapshot:
    """The old snapshot in the database, with such results."""
    study = Study.objects.create(name="Round 1", state="closed", seed=1, votes_per_expert=90)
    values = OLD["snapshot"] | {"results": Results()}
    values["reason"] = values.pop("status")  # as migration 0029 calls it
    snapshot = Snapshot.objects.create(study=study, **values)
    for line in OLD["standings"]:
        Standing.objects.create(snapshot=snapshot, **line)
    with connection.cursor() as cursor:
        asked = "UPDATE arena_snapshot SET results = %s WHERE id = %s"
        cursor.execute(asked, [json.dumps(results), snapshot.pk])
    return Snapshot.objects.get(pk=snapshot.pk)
