"""What the house holds: the counts that an admin's home page starts from."""

from __future__ import annotations

from dataclasses import dataclass

from arena.models import Study, Vote
from augment.models import Augmentation, Contestant, GenerationJob, Scenario

CHECK_PERCENT = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Inventory:
    """How much of everything there is."""

    scenarios: int
    contestants: int
    jobs: int
    jobs_running: int
    done: int
    failed: int
    studies: int
    studies_open: int
    studies_closed: int
    votes: int


def take_inventory() -> Inventory:
    """Count; failed augmentations of cancelled jobs don't count, nobody waits for them."""
    jobs = GenerationJob.objects
    augmentations = Augmentation.objects
    failed = augmentations.filter(state=Augmentation.State.FAILED)
    return Inventory(
        scenarios=Scenario.objects.count(),
        contestants=Contestant.objects.count(),
        jobs=jobs.count(),
        jobs_running=jobs.filter(state=GenerationJob.State.RUNNING).count(),
        done=augmentations.filter(state=Augmentation.State.DONE).count(),
        failed=failed.exclude(job__state=GenerationJob.State.CANCELLED).count(),
        studies=Study.objects.count(),
        studies_open=Study.objects.filter(state=Study.State.OPEN).count(),
        studies_closed=Study.objects.filter(state=Study.State.CLOSED).count(),
        votes=Vote.objects.filter(superseded_by=None).exclude(outcome=Vote.Outcome.SKIP).count(),
    )


def usual_checks() -> int:
    """Attention checks in percent where nobody says how many: none before any are drawn."""
    is_drawn = Augmentation.objects.filter(contestant__kind=Contestant.Kind.CHECK).exists()
    return CHECK_PERCENT if is_drawn else 0
