"""Realism of stored augmentations: single, and between random and recorded traffic."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from itertools import groupby
from statistics import fmean
from uuid import UUID

import numpy as np

from augment.checks import Ground
from augment.errors import InvalidModification
from augment.metrics import realism as metric
from augment.metrics.displacement import CLASS_OF
from augment.metrics.realism import SCORES as SCORES
from augment.models import Augmentation, BaseScene, Contestant, GenerationJob, Scenario
from augment.scene.codec import scene_from_document
from augment.scene.entities import Modification
from augment.services.judging.measures import Measure, read_change, rows_by_scenario
from augment.services.scenarios.scenes import LoadedScenario, scenario_seed

MOST_SCENES = 40
"""So many scenes are learned from; of more, those whose digests come first: a fixed sample."""
RANDOM_DRAWS = 4
"""So often the objects of a scenario are placed at random."""


class Subject(StrEnum):
    """Subject of a line, in the order of a table."""

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
        """Heading of the line."""
        return self.contestant.name if self.contestant else NAMES[self.subject]

    @property
    def is_simulated(self) -> bool:
        """True if its contestant is simulated."""
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
    version: int = metric.REALISM_VERSION


def realism_of_job(job: GenerationJob) -> RealismTable:
    """Return the table of a job, of what is stored as far as it is."""
    rows = list(
        job.augmentations.filter(state__in=Augmentation.SHOWABLE)
        .order_by("scenario", "pk")
        .select_related("contestant")
        .defer("modification", "notes")
    )
    by_row = REALISM.of(row.pk for row in rows)
    answers = {
        scenario: list(group) for scenario, group in groupby(rows, key=lambda row: row.scenario_id)
    }
    done = Augmentation.State.DONE
    patterns = {  # the first row with an answer, else the first
        scenario: next((row for row in group if row.state == done), group[0]).pk
        for scenario, group in answers.items()
    }
    surroundings = SURROUNDINGS.of(patterns.values())
    beside: defaultdict[tuple[Subject, int], list[_Beside]] = defaultdict(list)
    for scenario, pattern in patterns.items():
        (recorded,) = surroundings[pattern][Subject.RECORDING]
        for subject, values in surroundings[pattern].items():
            beside[subject, 0] += [(value, recorded) for value in values]
        for row in answers[scenario]:
            if row.contestant.kind != Contestant.Kind.REFERENCE:
                pair = (by_row.get(row.pk), recorded)
                beside[Subject.CONTESTANT, row.contestant_id].append(pair)
    contestants = {row.contestant_id: row.contestant for row in rows}
    lines = [_line(subject, contestants.get(pk), pairs) for (subject, pk), pairs in beside.items()]
    scenes = min(BaseScene.objects.count(), MOST_SCENES)
    return RealismTable(job=job.name, lines=tuple(sorted(lines, key=_place)), scenes=scenes)


# --- Private -----------------------------------------------------------------------------------


_Beside = tuple[metric.Realism | None, metric.Realism | None]
"""That of a change, and of what was recorded in its scene."""
Surroundings = dict[Subject, tuple[metric.Realism | None, ...]]
"""The realism of what a scenario's answers are held against.

That of what was recorded in its scene is of the classes that a pattern changes, and the pattern's
objects are placed at random; the pattern is the reference, without one the first answer.
"""


class _ScenarioRealism:
    """One scenario, whose changes are judged by the other scenes."""

    def __init__(self, scenario: Scenario, recorded: metric.RecordedCounts) -> None:
        self._scenario = scenario
        self._ground = Ground.of(LoadedScenario(scenario).scene)
        self._recorded = recorded

    def of(self, change: Modification | None) -> metric.Realism | None:
        """Return the realism of a change, None where it can't be judged."""
        if change is None:
            return None
        try:
            return self._judge(metric.measure_change(self._ground, change))
        except InvalidModification:
            return None

    def recording(self, pattern: Modification) -> metric.Realism | None:
        """Return that of what was recorded here, of the classes that the pattern changes."""
        classes = {CLASS_OF[agent.type] for agent in pattern.changed}
        objects = _read_objects(*_key(self._scenario.base_scene))
        return self._judge([thing for thing in objects if thing.object_class in classes])

    def random(self, pattern: Modification) -> list[metric.Realism | None]:
        """Return those of the pattern's objects anywhere; always the same for a scenario."""
        rng = np.random.default_rng(scenario_seed(self._scenario.slug))
        return [
            self.of(metric.place_at_random(self._ground, pattern, rng))
            for _ in range(RANDOM_DRAWS)
        ]

    def _judge(self, objects: list[metric.PlacedObject]) -> metric.Realism | None:
        realism = metric.judge(objects, self._recorded)
        return None if realism.mean is None else realism


def _list_learned_scenes() -> list[tuple[UUID, str]]:
    """Return the keys of the scenes that are learned from, as `_key` has them."""
    scenes = BaseScene.objects.order_by("content_hash", "slug")
    return list(scenes.values_list("code", "content_hash")[:MOST_SCENES])


def _learn_scenarios(
    ids: Collection[int],
) -> Iterator[tuple[Scenario, _ScenarioRealism, list[Augmentation]]]:
    """Yield each scenario, what judges its changes by all other scenes, and its rows."""
    nothing = metric.RecordedCounts()
    counts = {key: metric.count_recorded(_read_objects(*key)) for key in _list_learned_scenes()}
    total = sum(counts.values(), nothing)
    for scenario, rows in rows_by_scenario(Augmentation.objects.filter(pk__in=ids)):
        others = total - counts.get(_key(scenario.base_scene), nothing)
        yield scenario, _ScenarioRealism(scenario, others), rows


def _judge_rows(ids: Collection[int]) -> dict[int, metric.Realism]:
    values = {
        row.pk: judged.of(read_change(row.modification))
        for _, judged, rows in _learn_scenarios(ids)
        for row in rows
    }
    return {pk: value for pk, value in values.items() if value is not None}


def _judge_surroundings(ids: Collection[int]) -> dict[int, Surroundings]:
    surroundings: dict[int, Surroundings] = {}
    for scenario, judged, rows in _learn_scenarios(ids):
        reference = LoadedScenario(scenario).reference
        for row in rows:
            pattern = reference or read_change(row.modification) or Modification()
            surroundings[row.pk] = {
                Subject.RECORDING: (judged.recording(pattern),),
                Subject.REFERENCE: () if reference is None else (judged.of(reference),),
                Subject.RANDOM: tuple(judged.random(pattern)),
            }
    return surroundings


REALISM = Measure("realism", metric.Realism, _judge_rows, lambda: str(_list_learned_scenes()))
"""The realism of augmentations; none of what can't be judged."""
SURROUNDINGS = Measure(
    "surroundings", Surroundings, _judge_surroundings, lambda: str(_list_learned_scenes())
)


def _key(scene: BaseScene) -> tuple[UUID, str]:
    """Return the cache key of a scene: its row and its content's hash."""
    return scene.code, scene.content_hash


@lru_cache(maxsize=4 * MOST_SCENES)
def _read_objects(code: UUID, content_hash: str) -> tuple[metric.PlacedObject, ...]:
    """Return the recorded objects of a scene; a quarter of a second for a hundred objects."""
    document = BaseScene.objects.values_list("document", flat=True).get(code=code)
    return tuple(metric.measure_recorded(Ground.of(scene_from_document(document))))


def _line(
    subject: Subject, contestant: Contestant | None, pairs: Sequence[_Beside]
) -> RealismLine:
    judged = [realism for realism, _ in pairs if realism is not None]
    recorded = [
        other.mean for realism, other in pairs if realism and other and other.mean is not None
    ]
    return RealismLine(
        subject=subject,
        contestant=contestant,
        changes=len(judged),
        left_out=len(pairs) - len(judged),
        objects=sum(realism.judged for realism in judged),
        scores={
            name: fmean(values)
            for name in SCORES
            if (values := [realism.scores[name] for realism in judged if name in realism.scores])
        },
        mean=fmean([realism.mean or 0.0 for realism in judged]) if judged else None,
        recorded=fmean(recorded) if recorded else None,
    )


def _place(line: RealismLine) -> tuple[int, float, str]:
    return list(Subject).index(line.subject), -(line.mean or 0.0), line.name.lower()
