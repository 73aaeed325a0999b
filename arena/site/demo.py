"""The demo's parts, each made at once: for `manage.py demo` and for an admin's first steps.

Whatever is there already is used again. Simulated contestants and votes are marked everywhere.
"""

import socket
from collections.abc import Callable, Sequence
from typing import Any

from django.contrib.auth.models import User

from arena.models import Study
from arena.people.services import create_person
from arena.results.services.ratings import rate_now
from arena.studies.services.opening import close_study, open_study
from arena.studies.services.plan import StudyPlan
from arena.voting.services.simulation import simulate_votes
from augment.errors import Conflict
from augment.models import Contestant, Endpoint, GenerationJob, Scenario
from augment.services import endpoints, running
from augment.services.running.jobs import launch
from augment.services.scenarios import load_catalogue, resolve_scenarios
from augment.services.scenarios.choosing import ALL

STAND_IN = "stand-in"
SIMULATED = (
    ("sim-good-otm", "otm", "fake-good", "Simulated good OTM"),
    ("sim-careless-otm", "otm", "fake-careless", "Simulated careless OTM"),
    ("sim-careless-fc", "fc", "fake-careless", "Simulated careless FC"),
    ("sim-careless-fc-plus", "fc-plus", "fake-careless", "Simulated careless FC-plus"),
    ("sim-careless-tqa", "tqa", "fake-careless", "Simulated careless tQA"),
)
RATED = (endpoints.REFERENCE, "rule-placer", "sim-good-otm", "sim-careless-otm")
"""Who is voted on: with more, so few votes would leave no intervals."""

SIMULATED_EXPERTS = tuple(f"sim-expert-{number}" for number in range(1, 6))
JOB = "Demo: the catalogue"
SIMULATED_STUDY = "Demo (simulated votes)"
A_FEW = 2
"""So many scenarios of each type make a job of a minute."""

SEED = 7
SIMULATED_VOTES_EACH = 40


def load_scenarios(actor: User | None = None) -> None:
    """Load the authored scenarios of the paper's types."""
    load_catalogue(actor=actor)


def list_slugs(per_type: int | None, which: str = "paper") -> list[str]:
    """Slugs of a set of the catalogue: the first so many of each type, all where None is given."""
    kinds: dict[str, list[str]] = {}
    authored = Scenario.objects.filter(catalogue_set=which, paraphrase_of=None)
    for slug, kind in authored.values_list("slug", "type"):
        kinds.setdefault(kind, []).append(slug)
    return [slug for slugs in kinds.values() for slug in slugs[:per_type]]


def add_stand_in(actor: User | None = None) -> None:
    """Add the endpoint of the stand-in models, which `serve` starts."""
    if not Endpoint.objects.filter(label=STAND_IN).exists():
        request = endpoints.EndpointRequest(
            label=STAND_IN, base_url=free_address(), is_simulated=True
        )
        endpoints.ensure_endpoint(request, actor)


def add_contestants(actor: User | None = None) -> None:
    """Add contestants that ask the stand-in models, and those that ask none."""
    endpoints.ensure_builtin()
    add_stand_in(actor)
    for slug, variant, model, name in SIMULATED:
        if Contestant.objects.filter(slug=slug).exists():  # of an earlier version, maybe
            continue
        request = endpoints.ContestantRequest(
            slug=slug, variant=variant, endpoint=STAND_IN, model=model, name=name
        )
        endpoints.add_contestant(request, actor)


def add_experts(actor: User | None = None) -> None:
    """Add the experts that the machine votes for."""
    usernames = set(User.objects.values_list("username", flat=True))
    for username in SIMULATED_EXPERTS:
        if username not in usernames:
            create_person(
                username=username, password=None, role="expert", is_simulated=True, actor=actor
            )


def launch_job(
    actor: User | None = None, scenarios: Sequence[str] = (), *, leave_out: Sequence[str] = ()
) -> GenerationJob:
    """Launch the demo's job, all contestants on the scenarios, by default a few of each type."""
    if job := GenerationJob.objects.filter(name=JOB).first():
        return job
    chosen = scenarios or list_slugs(A_FEW) or resolve_scenarios([ALL])
    contestants = [slug for slug in running.resolve_contestants([ALL]) if slug not in leave_out]
    request = running.JobRequest(name=JOB, contestants=contestants, scenarios=chosen)
    return launch(request, actor)


def hold_study(
    actor: User | None = None,
    scenarios: Sequence[str] = (),
    *,
    name: str = SIMULATED_STUDY,
    contestants: Sequence[str] = RATED,
) -> Study:
    """Open a study, let simulated experts vote, close and rate it; by default of the last job.

    One that was begun and cut short is gone on with.

    Raises:
        Conflict: No job is finished.
    """
    study = Study.objects.filter(name=name).first()
    if study is None:
        study = _open_simulated(actor, scenarios, name, contestants)
    if study.state == Study.State.OPEN:
        simulate_votes(study=study, seed=SEED)
        study = close_study(study=study, actor=actor)
    if not study.snapshots.exists():
        rate_now(study=study, seed=SEED)
    return study


def _open_simulated(
    actor: User | None, scenarios: Sequence[str], name: str, contestants: Sequence[str]
) -> Study:
    if not scenarios:
        job = GenerationJob.objects.filter(state=GenerationJob.State.FINISHED).first()
        if job is None:
            raise Conflict("No job is finished yet; a study compares what one has made.")
        scenarios = list(job.scenarios.values_list("slug", flat=True))
        ran = set(job.contestants.values_list("slug", flat=True))
        contestants = RATED if set(RATED) <= ran else sorted(ran)
    add_experts(actor)
    values = study_asked(name, scenarios, contestants)
    values |= {"experts": SIMULATED_EXPERTS, "show_alike": True}
    plan = StudyPlan.read(values | {"votes_per_expert": SIMULATED_VOTES_EACH})
    return open_study(plan, actor=actor)


def study_asked(
    name: str, scenarios: Sequence[str], contestants: Sequence[str] = RATED
) -> dict[str, Any]:
    """Return the fields that the demo's studies share."""
    return {
        "name": name,
        "contestants": contestants,
        "scenarios": scenarios,
        "seed": SEED,
        "repeats": 0.0,
        "allow_simulated": True,
    }


def free_address() -> str:
    """Return an address of this computer that nobody listens at."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return f"http://127.0.0.1:{probe.getsockname()[1]}/v1"


ACTS: dict[str, Callable[[User], GenerationJob | Study | None]] = {
    "models": add_stand_in,
    "scenarios": load_scenarios,
    "contestants": add_contestants,
    "job": launch_job,
    "experts": add_experts,
    "study": hold_study,
}
"""What *Use the demo's* does, by the name of the step."""
