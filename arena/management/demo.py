"""The main job on the catalogue, from the scenes to the exported table, with simulated votes.

Every step can be repeated: what is there already is used again, so a second run changes nothing.
"""

import time
from collections.abc import Callable
from pathlib import Path

from django.contrib.auth.models import User

from arena.errors import ArenaError
from arena.exports.files import write_whole
from arena.models import Study
from arena.people.services import create_person
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import FORMATS, plain_text
from arena.site import demo
from arena.studies.services.opening import open_study
from arena.studies.services.plan import StudyPlan
from augment import models
from augment.services.benchmarks import BenchmarkRequest, make_benchmark
from augment.services.driving import plan_scenario
from augment.services.driving.simulations import Options
from augment.services.running import count_rows
from augment.services.scenarios import load_catalogue
from augment.tasks import enqueue_job, enqueue_simulations

PASSWORD = "arena-demo"  # for the demo's own accounts on this computer
PEOPLE = (("admin", "admin"), ("researcher", "researcher"), ("expert", "expert"))
OPEN_STUDY = "Try it yourself"
YOUR_VOTES = 30
STUCK_S = 600.0
"""A job in which nothing ends for so long is stuck; a slow computer only takes its time."""

A_LINE_EVERY = 8
DRIVEN_PER_TYPE = 2


class DemoFailed(ArenaError):
    """A step of the demo did not end as it should; the text says which and how."""


def prepare(say: Callable[[str], None]) -> None:
    """Scenes, scenarios, contestants and people; nothing here needs a running worker."""
    demo.load_scenarios()
    load_catalogue(sets=["moving"])
    scenarios, scenes = models.Scenario.objects.count(), models.BaseScene.objects.count()
    say(f"Catalogue: {scenarios} scenarios on {scenes} scenes")
    if not models.Benchmark.objects.exists():
        make_benchmark(
            BenchmarkRequest(slug="paper", title="The paper’s types", scenarios=["set:paper"])
        )
    models.Endpoint.objects.filter(label=demo.STAND_IN).update(base_url=demo.free_address())
    demo.add_contestants()
    say(f"Contestants: {', '.join(models.Contestant.objects.values_list('slug', flat=True))}")
    usernames = set(User.objects.values_list("username", flat=True))
    for username, role in PEOPLE:
        if username not in usernames:
            create_person(username=username, password=PASSWORD, role=role)
    demo.add_experts()


def generate(
    scenarios: list[str], say: Callable[[str], None], look: Callable[[], None]
) -> models.GenerationJob:
    """Every contestant on every one of the scenarios, through the workers.

    Args:
        scenarios: Slugs.
        say: Told the progress.
        look: Called again and again; it raises where a worker is gone for good.

    Raises:
        DemoFailed: It does not get on, or rows failed.
    """
    job = demo.launch_job(scenarios=scenarios)
    enqueue_job(job.pk)
    ended, moved_at = -A_LINE_EVERY, time.monotonic()
    while (now := count_rows(job)).under_way:
        look()
        if now.settled >= ended + A_LINE_EVERY:
            ended, moved_at = now.settled, time.monotonic()
            say(f"  {ended} of {now.total} augmentations")
        elif time.monotonic() - moved_at > STUCK_S:
            raise DemoFailed(f"{job.name!r} does not get on: {now.settled} of {now.total}.")
        time.sleep(0.2)
    ends = {state.value: number for state, number in now.by_state.items() if number}
    say(f"Augmentations: {', '.join(f'{number} {state}' for state, number in ends.items())}")
    if now.failed:
        reasons = job.augmentations.filter(state=models.Augmentation.State.FAILED)
        raise DemoFailed("; ".join(sorted(set(reasons.values_list("reason", flat=True)))))
    return job


def start_drives() -> list[int]:
    """Have a few scenarios driven by the workers, before the change and with the reference.

    Returns:
        The keys of the drives.
    """
    rows = models.Scenario.objects.filter(slug__in=demo.list_slugs(DRIVEN_PER_TYPE))
    waiting = [pk for row in rows for pk in plan_scenario(scenario=row, options=Options())]
    enqueue_simulations(waiting)
    return waiting


def finish_drives(drives: list[int], look: Callable[[], None]) -> None:
    """Wait until they are over.

    Raises:
        DemoFailed: They take longer than STUCK_S.
    """
    give_up_at = time.monotonic() + STUCK_S
    under_way = models.Simulation.objects.filter(
        pk__in=drives, state__in=models.Simulation.UNDER_WAY
    )
    while left := under_way.count():
        look()
        if time.monotonic() > give_up_at:
            raise DemoFailed(f"{left} of {len(drives)} drives are not over.")
        time.sleep(0.2)


def vote_and_rate(scenarios: list[str], folder: Path) -> tuple[str, list[Path]]:
    """Return the table of a study with simulated votes, and the files that it is written to."""
    study = demo.hold_study(scenarios=scenarios)
    if not Study.objects.filter(name=OPEN_STUDY).exists():
        # Two of a scenario's six pairs can be decided, and nobody sees one twice.
        votes = min(YOUR_VOTES, 2 * len(scenarios))
        values = demo.study_asked(OPEN_STUDY, scenarios) | {"experts": ["expert"]}
        open_study(StudyPlan.read(values | {"votes_per_expert": votes}))
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
