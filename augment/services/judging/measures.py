"""Measures of augmentations, stored with a key of all that they depend on.

In: primary keys of augmentations. Out: what was measured of each, from the store where its key is
still the same, else computed and stored. A key covers the code of the measuring packages, the
outcome of the row and of the one that it follows, the scenario's reference, intent and traffic,
its scene, and for realism the scenes that were learned from.
"""

import hashlib
import json
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from django.core.files.storage import default_storage
from django.db.models import QuerySet
from pydantic import TypeAdapter

from augment.errors import InvalidDocument
from augment.models import Augmentation, Scenario, StoredMeasure
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import store_as

Value = TypeVar("Value")
Compute = Callable[[Collection[int]], Mapping[int, Value]]

MEASURING = "metrics", "checks", "scene", "geometry", "simulation", "services/judging"
"""The packages of augment whose code decides what comes out."""

COMPUTED = "computed"
"""The folder in the media storage of what `compute_once` keeps."""

_ROOT = Path(__file__).parents[2]

_ROW = ("state", "finished_at", "follows__finished_at", "follows__scenario")
_SCENARIO = (
    "reference",
    "intent",
    "keep_traffic",
    "traffic_density",
    "goal",
    "spawned",
    "base_scene__slug",
    "base_scene__content_hash",
)


class Measure(Generic[Value]):
    """One measure of augmentations.

    Args:
        name: What it is called in the store.
        kind: The type of its values, as pydantic reads and writes it.
        compute: Measures the augmentations with these keys; it may leave some out.
        context: Returns what it depends on beside the row and its scenario.
    """

    def __init__(
        self, name: str, kind: Any, compute: Compute[Value], context: Callable[[], str] = str
    ) -> None:
        self.name = name
        self._adapter: TypeAdapter[Value | None] = TypeAdapter(kind | None)
        self._compute = compute
        self._context = context

    def of(self, ids: Iterable[int]) -> dict[int, Value]:
        """Return the values of the augmentations with these keys, without those that have none."""
        keys = self._keys(digest_rows(ids))
        stored = StoredMeasure.objects.filter(name=self.name, augmentation__in=keys)
        values = {
            pk: self._adapter.validate_python(document)
            for pk, key, document in stored.values_list("augmentation", "key", "document")
            if keys[pk] == key
        }
        if missing := sorted(keys.keys() - values.keys()):
            fresh = self._compute(missing)
            values |= {pk: fresh.get(pk) for pk in missing}
            StoredMeasure.objects.bulk_create(
                [
                    StoredMeasure(
                        augmentation_id=pk,
                        name=self.name,
                        key=keys[pk],
                        document=self._adapter.dump_python(values[pk], mode="json"),
                    )
                    for pk in missing
                ],
                batch_size=500,
                update_conflicts=True,
                unique_fields=("augmentation", "name"),
                update_fields=("key", "document"),
            )
        return {pk: value for pk, value in values.items() if value is not None}

    def count_stale(self, digests: Mapping[int, str]) -> int:
        """Return how many of the rows of `digest_rows` would have to be computed."""
        keys = self._keys(digests)
        stored = StoredMeasure.objects.filter(name=self.name, augmentation__in=keys)
        return len(keys.items() - set(stored.values_list("augmentation", "key")))

    def _keys(self, digests: Mapping[int, str]) -> dict[int, str]:
        base = _digest([digest_code(), self._context()])
        return {pk: _digest([base, digest]) for pk, digest in digests.items()}


def rows_by_scenario(
    rows: QuerySet[Augmentation],
) -> Iterator[tuple[Scenario, list[Augmentation]]]:
    """Yield each scenario with its rows; scenes are read one at a time."""
    of: defaultdict[int, list[Augmentation]] = defaultdict(list)
    for row in rows.defer("notes").order_by("pk"):
        of[row.scenario_id].append(row)
    scenarios = Scenario.objects.filter(pk__in=of).select_related("base_scene")
    for scenario in scenarios.defer("base_scene__recording").iterator(chunk_size=10):
        yield scenario, of[scenario.pk]


def digest_rows(ids: Iterable[int]) -> dict[int, str]:
    """Return a digest of each that has an outcome, by its primary key; two queries."""
    rows = Augmentation.objects.filter(pk__in=list(ids), state__in=Augmentation.SHOWABLE)
    values = list(rows.order_by("pk").values_list("pk", "scenario", *_ROW))
    wanted = {scenario for _, scenario, *own in values for scenario in (scenario, own[-1])}
    scenarios = Scenario.objects.filter(pk__in=wanted).order_by("pk")
    digests = {pk: _digest(own) for pk, *own in scenarios.values_list("pk", *_SCENARIO)}
    return {
        pk: _digest([pk, digests[scenario], digests.get(own[-1]), *own[:-1]])
        for pk, scenario, *own in values
    }


def _digest(parts: Any) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def read_change(document: object) -> Modification | None:
    """Return a stored modification, None where there is none that can be read."""
    try:
        return None if document is None else modification_from_document(document)
    except InvalidDocument:
        return None


@cache
def digest_code(*folders: Path) -> str:
    """Return a digest of the code in folders, or in those that measure: a change computes anew."""
    packages = folders or tuple(_ROOT / name for name in MEASURING)
    files = (path for package in packages for path in sorted(package.rglob("*.py")))
    return _digest([[path.name, path.read_text(encoding="utf-8")] for path in files])


def compute_once(suffix: str, compute: Callable[[], bytes], *parts: object) -> bytes:
    """Return the bytes computed from these parts; a file keeps them for the next time.

    Args:
        suffix: Of the file.
        compute: Makes the bytes, the same ones of the same parts.
        parts: All that it depends on; the `repr` of each has to say it all.
    """
    name = f"{COMPUTED}/{_digest(list(map(repr, parts)))}.{suffix}"
    try:
        with default_storage.open(name) as file:
            return bytes(file.read())
    except FileNotFoundError:
        store_as(name, made := compute())
        return made


def delete_computed(*, before: datetime) -> None:
    """Delete what was computed before that time; whoever asks for it computes it again."""
    media: Any = default_storage
    for name in media.find_older(COMPUTED, before):
        media.delete(name)
