"""The main job on the catalogue, from the scenes to the exported table, with simulated votes.

Every step can be repeated: what is there already is used again, so a second run changes nothing.
"""

import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User

from arena.errors import ArenaError
from arena.exports.files import write_whole
from arena.models import Study
from arena.people.services import create_person
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import FORMATS, plain_text
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study, open_study
from arena.studies.services.plan import StudyPlan
from arena.voting.services.simulation import simulate_votes
from augment.models import Augmentation, BaseScene, Contestant, Endpoint, GenerationJob, Scenario
from augment.services.endpoints.contestants import (
    REFERENCE,
    ContestantRequest,
    add_contestant,
    ensure_builtin,
)
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.judging.simulations import Options, plan_scenario
from augment.services.running.choosing import ALL, resolve_contestants
from augment.services.running.jobs import JobRequest, launch
from augment.services.running.progress import count_rows
from augment.services.scenarios.catalogue import load_catalogue
from augment.tasks import enqueue_job, enqueue_simulations

PASSWORD = "arena-demo"  # for the demo's own accounts on this computer
STAND_IN = "stand-in"
SIMULATED = (
    ("sim-good-otm", "otm", "fake-good", "Simulated good OTM"),
    ("sim-careless-otm", "otm", "fake-careless", "Simulated careless OTM"),
    ("sim-careless-fc", "fc", "fake-careless", "Simulated careless FC"),
    ("sim-careless-tqa", "tqa", "fake-careless", "Simulated careless tQA"),
)
RATED = (REFERENCE, "rule-placer", "sim-good-otm", "sim-careless-otm")
"""Who is voted on: with more, so few votes would leave no intervals."""

SIMULATED_EXPERTS = tuple(f"sim-expert-{number}" for number in range(1, 6))
PEOPLE = (("admin", "admin"), ("researcher", "researcher"), ("expert", "expert"))
JOB = "Demo: the catalogue"
SIMULATED_STUDY = "Demo (simulated votes)"
OPEN_STUDY = "Try it yourself"
SEED = 7
SIMULATED_VOTES_EACH = 40
YOUR_VOTES = 30
STUCK_S = 600.0
"""A job in which nothing ends for so long is stuck; a slow computer only takes its time."""

A_LINE_EVERY = 8
DRIVEN_PER_TYPE = 2


class DemoFailed(ArenaError):
    """A step of the demo did not end as it should; the text says which and how."""


def prepare(say: Callable[[str], None]) -> None:
    """Scenes, scenarios, contestants and people; nothing here needs a running worker."""
    load_catalogue(folder=settings.BASE_DIR / "fixtures")
    say(f"Catalogue: {len(scenarios_of(None))} scenarios on {BaseScene.objects.count()} scenes")
    ensure_builtin()
    address = _stand_in_address()
    Endpoint.objects.filter(label=STAND_IN).update(base_url=address)
    ensure_endpoint(EndpointRequest(label=STAND_IN, base_url=address, is_simulated=True))
    for slug, variant, model, name in SIMULATED:
        request = ContestantRequest(
            slug=slug, variant=variant, endpoint=STAND_IN, model=model, name=name
        )
        add_contestant(request)
    say(f"Contestants: {', '.join(Contestant.objects.values_list('slug', flat=True))}")
    for username, role in PEOPLE:
        _person(username, role)
    for username in SIMULATED_EXPERTS:
        _person(username, "expert", is_simulated=True)


def scenarios_of(per_type: int | None) -> list[str]:
    """Slugs of the catalogue: the first so many of each type, all where None is given."""
    kinds: dict[str, list[str]] = {}
    authored = Scenario.objects.filter(catalogue_set="paper", paraphrase_of=None)
    for slug, kind in authored.values_list("slug", "type"):
        kinds.setdefault(kind, []).append(slug)
    return [slug for slugs in kinds.values() for slug in slugs[:per_type]]


def generate(
    scenarios: list[str], say: Callable[[str], None], look: Callable[[], None]
) -> GenerationJob:
    """Every contestant on every one of the scenarios, through the workers.

    Args:
        scenarios: Slugs.
        say: Told the progress.
        look: Called again and again; it raises where a worker is gone for good.

    Raises:
        DemoFailed: It does not get on, or rows failed.
    """
    request = JobRequest(name=JOB, contestants=resolve_contestants([ALL]), scenarios=scenarios)
    job = GenerationJob.objects.filter(name=JOB).first() or launch(request)
    enqueue_job(job.pk)
    ended, moved_at = -A_LINE_EVERY, time.monotonic()
    while (now := count_rows(job)).under_way:
        look()
        if now.settled >= ended + A_LINE_EVERY:
            ended, moved_at = now.settled, time.monotonic()
            say(f"  {ended} of {now.total} augmentations")
        elif time.monotonic() - moved_at > STUCK_S:
            raise DemoFailed(f"The job {JOB!r} does not get on: {now.settled} of {now.total}.")
        time.sleep(0.2)
    ends = {state.value: number for state, number in now.by_state.items() if number}
    say(f"Augmentations: {', '.join(f'{number} {state}' for state, number in ends.items())}")
    if now.failed:
        reasons = job.augmentations.filter(state=Augmentation.State.FAILED)
        raise DemoFailed("; ".join(sorted(set(reasons.values_list("reason", flat=True)))))
    return job


def start_drives() -> None:
    """Have a few scenarios driven by the workers, before the change and with the reference."""
    rows = Scenario.objects.filter(slug__in=scenarios_of(DRIVEN_PER_TYPE))
    waiting = [pk for row in rows for pk in plan_scenario(scenario=row, options=Options())]
    enqueue_simulations(waiting)


def vote_and_rate(scenarios: list[str], folder: Path) -> tuple[str, list[Path]]:
    """Return the table of a study with simulated votes, and the files that it is written to."""
    study = Study.objects.filter(name=SIMULATED_STUDY).first()
    if study is None:
        asked = _study_asked(SIMULATED_STUDY, scenarios)
        asked |= {"experts": SIMULATED_EXPERTS, "show_alike": True}
        study = open_study(StudyPlan.read(asked | {"votes_per_expert": SIMULATED_VOTES_EACH}))
        simulate_votes(study=study, seed=SEED)
        study = close_study(study=study)
        rate(study=study, seed=SEED)
    if not Study.objects.filter(name=OPEN_STUDY).exists():
        # Two of a scenario's six pairs can be decided, and nobody sees one twice.
        votes = min(YOUR_VOTES, 2 * len(scenarios))
        asked = _study_asked(OPEN_STUDY, scenarios) | {"experts": ["expert"]}
        open_study(StudyPlan.read(asked | {"votes_per_expert": votes}))
    table = leaderboard_table(study.snapshots.latest("made_at"))
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for chosen in FORMATS.values():
        files.append(folder / f"leaderboard.{chosen.suffix}")
        write_whole(files[-1], chosen.write(table))
    return plain_text(table), files


def login_lines() -> list[str]:
    """Return a line for each account of the demo that still has the demo's password."""
    names = [username for username, _ in PEOPLE]
    return [
        f"  sign in as {user.username:8} password {PASSWORD}"
        for user in User.objects.filter(username__in=names, is_active=True).order_by("pk")
        if user.check_password(PASSWORD)
    ]


def _study_asked(name: str, scenarios: list[str]) -> dict[str, Any]:
    return {
        "name": name,
        "contestants": RATED,
        "scenarios": scenarios,
        "seed": SEED,
        "repeats": 0.0,
        "allow_simulated": True,
    }


def _person(username: str, role: str, *, is_simulated: bool = False) -> None:
    if not User.objects.filter(username=username).exists():
        create_person(
            username=username,
            password=None if is_simulated else PASSWORD,
            role=role,
            is_simulated=is_simulated,
        )


def _stand_in_address() -> str:
    """An address that nobody listens at."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return f"http://127.0.0.1:{probe.getsockname()[1]}/v1"
