"""Rows of augment: scenes, scenarios, contestants, jobs and what they produced.

Rows are the truth; a Celery message carries the key of a row. Every row that a person can see in
a URL has a random `code`; primary keys stay inside.
"""

from augment.models.benchmarks import Benchmark, BenchmarkItem
from augment.models.budgets import CappedWork
from augment.models.contestants import (
    CallLease,
    Contestant,
    Endpoint,
    EndpointModel,
    KeyBinding,
    Probe,
)
from augment.models.jobs import (
    Attempt,
    Augmentation,
    GenerationJob,
    IntentReading,
    ModelCall,
    NuplanResult,
    Simulation,
    TranscriptNote,
)
from augment.models.judging import JudgeRun, PairJudgement, StoredMeasure
from augment.models.scenes import SLUG_HELP, BaseScene, Scenario, SceneUpload, UploadMoment
from augment.models.submissions import Submission
from augment.models.sweeps import Sweep, SweepValue
from augment.models.work import (
    FAILED,
    AppendOnly,
    CodedModel,
    Event,
    SentFile,
    Work,
    Worker,
    account_column,
    after_migrations,
    before_migrations,
    user_column,
)
