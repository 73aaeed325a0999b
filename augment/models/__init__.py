"""Rows of augment: scenes, scenarios, contestants, jobs and what they produced.

Rows are the truth; a Celery message carries the key of a row. Every row that a person can see in
a URL has a random `code`; primary keys stay inside.
"""

from augment.models.append_only import AppendOnly
from augment.models.calls import ModelCall, TranscriptNote
from augment.models.contestants import Contestant
from augment.models.endpoints import CallLease, Endpoint, EndpointModel
from augment.models.events import Event
from augment.models.jobs import Attempt, Augmentation, GenerationJob
from augment.models.probes import Probe
from augment.models.readings import IntentReading
from augment.models.scenes import SLUG_HELP, BaseScene, Scenario
from augment.models.simulations import Simulation
from augment.models.triggers import after_migrations, before_migrations
from augment.models.uploads import SceneUpload, UploadMoment
from augment.models.work import FAILED, Work
from augment.models.workers import Worker

__all__ = [
    "FAILED",
    "SLUG_HELP",
    "AppendOnly",
    "Attempt",
    "Augmentation",
    "BaseScene",
    "CallLease",
    "Contestant",
    "Endpoint",
    "EndpointModel",
    "Event",
    "GenerationJob",
    "IntentReading",
    "ModelCall",
    "Probe",
    "Scenario",
    "SceneUpload",
    "Simulation",
    "TranscriptNote",
    "UploadMoment",
    "Work",
    "Worker",
    "after_migrations",
    "before_migrations",
]
