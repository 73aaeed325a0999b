"""Values of a benchmark set and of a submission."""

from dataclasses import dataclass, replace
from datetime import date
from enum import StrEnum
from typing import Annotated

from pydantic import BeforeValidator, Field

from augment.metrics.displacement import Displacement
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent
from augment.scene.recording import Recording
from augment.scene.schema import CLOSED, Real, Text, Whole, Yes

MOST_SAMPLES = 20


class Split(StrEnum):
    """Split of a task: practice comes with its reference, test without."""

    PRACTICE = "practice"
    TEST = "test"


class Stratum(StrEnum):
    """Difficulty of an instruction; `strata.py` has the limits."""

    EASY = "easy"
    MEDIUM = "medium"
    HARD = "hard"


Slug = Annotated[Text, Field(max_length=80, pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")]
_Type = Annotated[Text, Field(max_length=40, pattern=r"^[a-z0-9]+([_-][a-z0-9]+)*$")]


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskFacts:
    """What a task and its line in `benchmark.json` both say.

    Attributes:
        name: The slug of the scenario.
        type: The scenario's type, as a slug.
        language: Of the instruction.
        keeps_traffic: Whether the recorded vehicles stay.
        paraphrase_of: The task that asks for the same in other words, empty for none.
    """

    name: Slug
    instruction: Annotated[Text, Field(min_length=1, max_length=2_000)]
    type: _Type
    language: Annotated[Text, Field(pattern=r"^[a-z]{2}$")]
    split: Split
    stratum: Stratum
    keeps_traffic: Yes
    paraphrase_of: Annotated[Text, Field(max_length=80)] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchmarkTask(TaskFacts):
    """One scenario as entrants get it. Frame: the ego frame of its scene.

    Attributes:
        scene: Before the change, with the traffic that stays.
        recording: What was recorded after t0, None where nothing was.
        reference: None where it is not known here: in a folder that was handed out, of all tasks
            of the test split. An empty one says that the wish can't be met.
        intent: What the instruction asks for, known where the reference is; None where nobody has
            said it.
    """

    scene: Scene
    recording: Recording | None = None
    reference: Modification | None = None
    intent: Intent | None = None

    @property
    def replayed(self) -> Recording | None:
        """Recording, of the ego alone where the recorded traffic does not stay."""
        if self.recording is None or self.keeps_traffic:
            return self.recording
        return replace(self.recording, tracks=())


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchmarkSet:
    """Tasks of one version of a benchmark.

    Attributes:
        name: A slug; a version is a number from 1, and the two together never change.
    """

    name: str
    title: str
    version: int
    made_on: date
    tasks: tuple[BenchmarkTask, ...]


def _read_date(text: object) -> object:
    if isinstance(text, str):
        return date.fromisoformat(text)
    raise ValueError("Input should be a date such as 2026-11-20")


Day = Annotated[date, BeforeValidator(_read_date)]
_Name = Annotated[Text, Field(min_length=1, max_length=100, pattern=r"\S")]


class EntryStatus(StrEnum):
    """Result of one task in a submission; all but READ count as a miss."""

    READ = "read"
    REFUSED = "refused"
    UNREADABLE = "unreadable"
    MISSING = "missing"


@dataclass(frozen=True, slots=True, kw_only=True)
class SubmissionCard:
    """Authors and models of a submission: its `card.json`.

    Attributes:
        models: Names of language or other models that were used, empty for none.
        is_open: Whether code and weights are public.
        samples: Per scenario.
        cost_usd: Of the whole run, None where nobody knows.
        made_on: When it was made.
    """

    __pydantic_config__ = CLOSED

    name: _Name
    authors: Annotated[tuple[_Name, ...], Field(min_length=1, max_length=100)]
    method: Annotated[Text, Field(min_length=1, max_length=4_000, pattern=r"\S")]
    models: Annotated[tuple[_Name, ...], Field(max_length=100)]
    is_open: Yes
    samples: Annotated[Whole, Field(ge=1, le=MOST_SAMPLES)]
    cost_usd: Annotated[Real, Field(ge=0.0, le=1e9)] | None = None
    made_on: Day


@dataclass(frozen=True, slots=True, kw_only=True)
class SubmittedEntry:
    """One task in one sample of a submission.

    Attributes:
        file: Its name in the folder, empty where it is missing.
        reason: Why there is no modification, empty where it was read.
        notes: What was lost or assumed in reading it; what could not be matched.
        modification: In the frame of the task's scene.
        displacement: From the reference of a practice task; all of it is missing where nothing
            was read. None for tasks of the test split, also where their references are known.
        wish: The distance to the wish of a practice task, None where it has no intent.
    """

    task: str
    sample: int
    status: EntryStatus
    file: str = ""
    reason: str = ""
    notes: tuple[str, ...] = ()
    modification: Modification | None = None
    displacement: Displacement | None = None
    wish: Displacement | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SubmissionReport:
    """All that is said of a submission; offline and by the server the same.

    Attributes:
        benchmark, version, checksum: Against which it was read.
        entries: One for each task and sample, in the order of the tasks.
        remarks: On the folder as a whole, such as files that belong to no task.
    """

    benchmark: str
    version: Annotated[int, Field(alias="benchmark_version")]
    checksum: str
    card: SubmissionCard
    entries: tuple[SubmittedEntry, ...]
    remarks: tuple[str, ...] = ()
