"""How realistic stored augmentations are: one by one, and between floor and ceiling."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from statistics import fmean
from uuid import UUID

import numpy as np
from django.db.models import QuerySet

from augment.checks import Ground
from augment.errors import InvalidDocument, InvalidModification
from augment.metrics.displacement import CLASS_OF
from augment.metrics.realism import REALISM_VERSION as REALISM_VERSION
from augment.metrics.realism import SCORES as SCORES
from augment.metrics.realism import (
    PlacedObject,
    Realism,
    RecordedCounts,
    count_recorded,
    judge,
    measure_change,
    measure_recorded,
    place_at_random,
)
from augment.models import Augmentation, BaseScene, Contestant, GenerationJob, Scenario
from augment.scene.codec import modification_from_document, scene_from_document
from augment.scene.entities import Modification
from augment.services.scenarios.scenes import reference_of, scene_of, seed_of

MOST_SCENES = 40
"""So many scenes are learned from; of more, those whose digests come first: a fixed sample."""
RANDOM_DRAWS = 4
"""So often the objects of a scenario are placed at random."""


class Subject(StrEnum):
    """Whose realism a line states, in the order of a table."""

    RECORDING = "recording"
    REFERENCE = "reference"
    CONTESTANT = "contestant"
    RANDOM = "random"


NAMES = {
    Subject.RECORDING: "Recorded traffic",
    Subject.REFERENCE: "Reference",
    Subject.RANDOM: "Random placement",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class RealismLine:
    """The realism of one contestant, or of what it is held against.

    Attributes:
        contestant: None for all but contestants.
        changes: How many could be judged; the scores are means over them.
        left_out: Further ones: unreadable, refused, without an object, or of classes alone of
            which too little was recorded.
        objects: How many objects of those judged count.
        scores: By the names in `SCORES`.
        mean: None without a change that could be judged.
        recorded: The mean of what was recorded in the same scenes.
    """

    subject: Subject
    contestant: Contestant | None
    changes: int
    left_out: int
    objects: int
    scores: dict[str, float]
    mean: float | None
    recorded: float | None

    @property
    def name(self) -> str:
        """How it is headed."""
        return self.contestant.name if self.contestant else NAMES[self.subject]

    @property
    def is_simulated(self) -> bool:
        """Whether its contestant is simulated."""
        return self.contestant is not None and self.contestant.is_simulated


@dataclass(frozen=True, slots=True, kw_only=True)
class RealismTable:
    """The lines of a job: recorded traffic, reference, contestants best first, random placement.

    Attributes:
        scenes: How many scenes of the installation were learned from, at most; the scene that is
            judged is never among them.
    """

    job: str
    lines: tuple[RealismLine, ...]
    scenes: int
    version: int = REALISM_VERSION


def realism_of_job(job: GenerationJob) -> RealismTable:
    """Return the table of a job; a second for every hundred changes, more for the first time."""
    learned = _Recorded()
    found: defaultdict[tuple[Subject, int], list[_Beside]] = defaultdict(list)
    for scenario, rows in _by_scenario(job.augmentations.all()):
        judged = _Judged(scenario, learned)
        answers = {row: _change_of(row) for row in rows if row.state in Augmentation.SHOWABLE}
        reference = reference_of(scenario)
        pattern = reference or next(filter(None, answers.values()), Modification())
        recorded = judged.recording(pattern)
        here = [
            (Subject.RECORDING, 0, recorded),
            *((Subject.REFERENCE, 0, judged.of(one)) for one in [reference] if one is not None),
            *((Subject.RANDOM, 0, one) for one in judged.random(pattern)),
            *(
                (Subject.CONTESTANT, row.contestant_id, judged.of(change))
                for row, change in answers.items()
                if row.contestant.kind != Contestant.Kind.REFERENCE
            ),
        ]
        for subject, contestant, realism in here:
            found[subject, contestant].append((realism, recorded))
    contestants = Contestant.objects.in_bulk({pk for _, pk in found if pk})
    lines = [_line(subject, contestants.get(pk), ones) for (subject, pk), ones in found.items()]
    return RealismTable(
        job=job.name, lines=tuple(sorted(lines, key=_place)), scenes=len(learned.counts)
    )


def realism_of_rows(ids: Collection[int]) -> dict[int, Realism]:
    """Return the realism of the augmentations with these keys; without what can't be judged."""
    learned = _Recorded()
    found: dict[int, Realism | None] = {}
    for scenario, rows in _by_scenario(Augmentation.objects.filter(pk__in=ids)):
        judged = _Judged(scenario, learned)
        found |= {row.pk: judged.of(_change_of(row)) for row in rows}
    return {pk: realism for pk, realism in found.items() if realism is not None}


# --- Private -----------------------------------------------------------------------------------


_Beside = tuple[Realism | None, Realism | None]
"""That of a change, and of what was recorded in its scene."""


class _Recorded:
    """What is learned from the scenes of this installation."""

    def __init__(self) -> None:
        scenes = BaseScene.objects.order_by("content_hash", "slug").only("code", "content_hash")
        keys = [_key(scene) for scene in scenes[:MOST_SCENES]]
        self.counts = {key: count_recorded(_objects_of(*key)) for key in keys}
        self._total = sum(self.counts.values(), RecordedCounts())

    def without(self, scene: BaseScene) -> RecordedCounts:
        """Return the histograms of all other scenes."""
        return self._total - self.counts.get(_key(scene), RecordedCounts())


class _Judged:
    """One scenario, whose changes are judged by the other scenes."""

    def __init__(self, scenario: Scenario, learned: _Recorded) -> None:
        self._scenario = scenario
        self._ground = Ground.of(scene_of(scenario))
        self._recorded = learned.without(scenario.base_scene)

    def of(self, change: Modification | None) -> Realism | None:
        """Return the realism of a change, None where it can't be judged."""
        if change is None:
            return None
        try:
            return self._judge(measure_change(self._ground, change))
        except InvalidModification:
            return None

    def recording(self, pattern: Modification) -> Realism | None:
        """Return that of what was recorded here, of the classes that the pattern changes."""
        classes = {CLASS_OF[one.type] for one in pattern.changed}
        objects = _objects_of(*_key(self._scenario.base_scene))
        return self._judge([one for one in objects if one.object_class in classes])

    def random(self, pattern: Modification) -> list[Realism | None]:
        """Return those of the pattern's objects anywhere; always the same for a scenario."""
        rng = np.random.default_rng(seed_of(self._scenario.slug))
        return [self.of(place_at_random(self._ground, pattern, rng)) for _ in range(RANDOM_DRAWS)]

    def _judge(self, objects: list[PlacedObject]) -> Realism | None:
        realism = judge(objects, self._recorded)
        return None if realism.mean is None else realism


def _key(scene: BaseScene) -> tuple[UUID, str]:
    """Return what a scene is remembered by: its row and what it holds."""
    return scene.code, scene.content_hash


@lru_cache(maxsize=4 * MOST_SCENES)
def _objects_of(code: UUID, content_hash: str) -> tuple[PlacedObject, ...]:
    """Return what was recorded in a scene; a quarter of a second for a hundred objects."""
    document = BaseScene.objects.values_list("document", flat=True).get(code=code)
    return tuple(measure_recorded(Ground.of(scene_from_document(document))))


def _by_scenario(rows: QuerySet[Augmentation]) -> Iterator[tuple[Scenario, list[Augmentation]]]:
    """Yield each scenario with its rows; scenes are read one at a time."""
    of: defaultdict[int, list[Augmentation]] = defaultdict(list)
    for row in rows.select_related("contestant").defer("notes").order_by("pk"):
        of[row.scenario_id].append(row)
    scenarios = Scenario.objects.filter(pk__in=of).select_related("base_scene")
    for scenario in scenarios.defer("base_scene__recording").iterator(chunk_size=10):
        yield scenario, of[scenario.pk]


def _change_of(row: Augmentation) -> Modification | None:
    try:
        return None if row.modification is None else modification_from_document(row.modification)
    except InvalidDocument:
        return None


def _line(
    subject: Subject, contestant: Contestant | None, found: Sequence[_Beside]
) -> RealismLine:
    judged = [one for one, _ in found if one is not None]
    recorded = [other.mean for one, other in found if one and other and other.mean is not None]
    return RealismLine(
        subject=subject,
        contestant=contestant,
        changes=len(judged),
        left_out=len(found) - len(judged),
        objects=sum(one.judged for one in judged),
        scores={
            name: fmean(values)
            for name in SCORES
            if (values := [one.scores[name] for one in judged if name in one.scores])
        },
        mean=fmean([one.mean or 0.0 for one in judged]) if judged else None,
        recorded=fmean(recorded) if recorded else None,
    )


def _place(line: RealismLine) -> tuple[int, float, str]:
    return list(Subject).index(line.subject), -(line.mean or 0.0), line.name.lower()
