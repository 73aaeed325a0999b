"""`manage.py demo`: the main job on the catalogue, unattended, with simulated votes, then served.

Every step can be repeated: what is there already is used again, so a second run changes nothing.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.core.management import call_command
from django.core.management.base import CommandError
from django.db import transaction

from arena.errors import ArenaError
from arena.exports.files import write_whole
from arena.models import Snapshot, Study
from arena.people.services import create_person
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import FORMATS, plain_text
from arena.serving import stack
from arena.serving.supervisor import Supervisor
from arena.shell.sending import send_charts
from arena.site import demo
from arena.studies.services.opening import open_study
from arena.studies.services.plan import StudyPlan
from arena.voting.services.drawing import draw_pictures
from augment import models
from augment.errors import KeyMissing, ModelFault
from augment.services import TerminalCommand, at_least
from augment.services.benchmarks import BenchmarkRequest, make_benchmark
from augment.services.driving import plan_scenario
from augment.services.driving.simulations import Options
from augment.services.endpoints import (
    ContestantRequest,
    EndpointRequest,
    add_contestant,
    ensure_model,
    paper_variants,
)
from augment.services.endpoints.contestants import REFERENCE
from augment.services.judging import count_unmeasured, pairs_apart
from augment.services.running import JobRequest, count_rows
from augment.services.running.estimates import estimate
from augment.services.running.jobs import cancel, launch, retry_failed
from augment.services.scenarios import load_catalogue
from augment.tasks import enqueue_job, enqueue_simulations

State = models.Augmentation.State

PASSWORD = "arena-demo"  # for the demo's own accounts on this computer
PEOPLE = (("admin", "admin"), ("researcher", "researcher"), ("expert", "expert"))
OPEN_STUDY = "Try it yourself"
OPEN_STUDY_WITH_MODEL = f"{OPEN_STUDY}, with your model"
YOUR_VOTES = 20
VISIBLE_M = 1.0
SEEDS_TRIED = 12
STUCK_S = 600.0
"""A job without a row or a call more for so long is stuck; a slow model only takes its time."""

A_LINE_EVERY = 8
DRIVEN_PER_TYPE = 2
CALLS_PER_SCENARIO = 12
"""So many calls a model of one's own may take, 60 on the five scenarios that it gets."""


class Command(TerminalCommand):
    """Do the whole job with simulated contestants and votes, and say where everything is."""

    help = (
        "Load the catalogue, augment every scenario with every contestant, let simulated experts "
        "vote, rate, export the table, and serve the result."
    )

    arguments = {
        "--host": {"default": "127.0.0.1", "help": "address to listen on"},
        "--port": {"type": int, "default": 8000, "help": "port to listen on"},
        "--no-serve": {"action": "store_true", "help": "stop before serving"},
        "--per-type": {
            "type": at_least(1),
            "metavar": "N",
            "help": "only N scenarios of each type; default: all",
        },
        "--endpoint": {"default": "", "help": "address of a model of your own, up to /v1"},
        "--model": {"default": "", "help": "its id there; it runs on five scenarios"},
        "--key": {"default": "", "metavar": "VARIABLE", "help": "that holds the endpoint's key"},
        "--scenarios": {
            "choices": ("few", "all"),
            "default": "few",
            "help": "which of the demo's the model of your own runs on; default: few",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Run the demo; a fault of any step ends it with a sentence."""
        if bool(options["endpoint"]) != bool(options["model"]):
            raise CommandError("--endpoint and --model name a model together: give both.")
        try:
            with stack.hold_alone():
                self._run(options, serve=not options["no_serve"])
        except KeyboardInterrupt:
            raise CommandError(
                "The demo was stopped before it was done; started again, it goes on from there.",
                returncode=stack.INTERRUPTED,
            ) from None

    def _run(self, options: Mapping[str, Any], *, serve: bool) -> None:
        started, say = time.monotonic(), self.stdout.write
        web = stack.Web(host=options["host"], port=options["port"])
        server = [stack.web_server(web)] if serve else []
        call_command("prepare", verbosity=0)
        own = None
        if options["endpoint"]:
            request = EndpointRequest(base_url=options["endpoint"], key_variable=options["key"])
            own = add_model(request, options["model"])
        prepare(say)
        scenarios = [*demo.list_slugs(options["per_type"]), *demo.list_slugs(1, "moving")]
        jobs = [demo.launch_job(scenarios=scenarios, leave_out=own.contestants if own else ())]
        if own is not None:
            chosen = scenarios if options["scenarios"] == "all" else demo.list_slugs(1)
            jobs.append(launch_model(own, chosen, say))
        supervisor = Supervisor([*stack.background(concurrency=4), *server], self._keep)
        with supervisor.signals():
            try:
                supervisor.start()
                look = partial(_look_at, supervisor)
                for job in jobs:  # the last one's scenarios are those of the studies
                    scenarios = finish(job, say, look)
                study = open_for_votes(scenarios, own)
                if study.state == Study.State.OPEN:
                    took_s = time.monotonic() - started
                    say(f"“{study.name}” is open for votes after {took_s:.0f} s.")
                wait_for(partial(count_unmeasured, jobs[0]), look)  # which a worker measures
                text, files = vote_and_rate(scenarios, settings.VAR_DIR / "demo", own)
                send_charts(Snapshot.objects.latest("made_at").pk)
                drives = start_drives()
                say(f"\n{text}\n\nTables: {', '.join(map(str, files))}")
                if drives:
                    say(f"{len(drives)} drives follow in the background.")
                if not serve:
                    waiting = {"pk__in": drives, "state__in": models.Simulation.UNDER_WAY}
                    if left := wait_for(models.Simulation.objects.filter(**waiting).count, look):
                        raise DemoFailed(f"{left} of {len(drives)} drives are not over.")
                self._show(web, time.monotonic() - started, serve=serve)
                if serve and not supervisor.is_stopping:
                    supervisor.watch(stack.missing_stand_ins)
            finally:
                supervisor.stop()

    def _show(self, web: stack.Web, took_s: float, *, serve: bool) -> None:
        where = "Scenario Arena is at" if serve else "“make serve” serves it at"
        lines = [
            f"The demo took {took_s:.0f} s.\n",
            f"{where} {web.address}",
            *login_lines(),
            "  Vote as 'expert' in the study that is open.",
            f"  See the drives as 'admin': Jobs, {demo.JOB!r}, See the drives.",
        ]
        self.stdout.write("\n".join(lines))

    @staticmethod
    def _keep(name: str, line: str) -> None:
        """Append a child's line to its own log, so that the demo's lines stay readable."""
        folder = settings.VAR_DIR / "log"
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / f"{name}.log").open("a") as log:
            log.write(f"{line}\n")


def _look_at(supervisor: Supervisor) -> None:
    """Start again what crashed, and end the wait when somebody pressed Ctrl-C."""
    supervisor.check()
    supervisor.insist_on_steadiness()
    if supervisor.is_stopping:
        raise KeyboardInterrupt


class DemoFailed(ArenaError):
    """A step of the demo did not end as it should; the text says which and how."""


@dataclass(frozen=True, kw_only=True)
class OwnModel:
    """A model of one's own in the demo: as slugs have it, its contestants, its probe's calls."""

    name: str
    contestants: tuple[str, ...]
    probe_calls: int

    @property
    def rated(self) -> tuple[str, ...]:
        """Who is compared: its contestants beside the demo's."""
        return (*demo.RATED, *self.contestants)


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
    for username, role in PEOPLE:
        if not User.objects.filter(username=username).exists():
            create_person(username=username, password=PASSWORD, role=role)
    demo.add_experts()


def add_model(request: EndpointRequest, model: str) -> OwnModel:
    """Add contestants of a model that answers; of one that doesn't nothing is made.

    Raises:
        InvalidDocument: The address or the variable of its key can't be used.
        DemoFailed: The model does not answer, or its key is not set.
    """
    try:
        row = ensure_model(request, model=model)
    except (KeyMissing, ModelFault) as fault:
        raise DemoFailed(f"{model} at {request.base_url} can’t be asked: {fault}") from None
    variants = paper_variants(row)
    asked = {"endpoint": row.endpoint, "model": model, "options": {}, "roles": {}}
    known = dict(models.Contestant.objects.filter(**asked).values_list("variant", "slug"))
    for variant in variants:
        if variant not in known:
            wanted = ContestantRequest(variant=variant, endpoint=row.endpoint.label, model=model)
            known[variant] = add_contestant(wanted).slug
    report = row.probe_report or {}
    slugs = tuple(known[variant] for variant in variants)
    name = "".join(slugs[0].rsplit("-otm", 1))  # of the same model elsewhere it is another
    return OwnModel(name=name, contestants=slugs, probe_calls=1 + report.get("calls", 0))


def launch_model(
    own: OwnModel, scenarios: list[str], say: Callable[[str], None]
) -> models.GenerationJob:
    """Launch a model's job on the scenarios within its cap, and say before what it may use."""
    name = f"Demo: {own.name}"[:120]
    if job := models.GenerationJob.objects.filter(name=name).first():
        return job
    cap = CALLS_PER_SCENARIO * len(scenarios) - own.probe_calls
    request = JobRequest(
        name=name, contestants=own.contestants, scenarios=scenarios, cap_calls=cap
    )
    _, usual, most = estimate(request).calls
    say(
        f"{own.name}: {', '.join(own.contestants)} on {len(scenarios)} scenarios, {usual} calls "
        f"expected, at most {min(cap, most)}, after {own.probe_calls} of its probe; cost unknown"
    )
    return launch(request)


def finish(
    job: models.GenerationJob, say: Callable[[str], None], look: Callable[[], None]
) -> list[str]:
    """Have the workers run a job; what is beyond its cap is cancelled.

    Args:
        job: Which.
        say: Told the progress.
        look: Called again and again; it raises where a worker is gone for good.

    Returns:
        The scenarios that are done by all of its contestants.

    Raises:
        DemoFailed: It does not get on, or rows failed.
    """
    if count_rows(job).failed:
        retry_failed(job)
    enqueue_job(job.pk)
    calls = models.ModelCall.objects.filter(attempt__augmentation__job=job)
    told, steps, moved_at = -A_LINE_EVERY, 0, time.monotonic()
    while (now := count_rows(job)).is_moving:
        look()
        if now.settled >= told + A_LINE_EVERY:
            told = now.settled
            say(f"  {told} of {now.total} augmentations")
        if (step := now.settled + calls.count()) > steps:
            steps, moved_at = step, time.monotonic()
        elif time.monotonic() - moved_at > STUCK_S:
            raise DemoFailed(f"{job.name!r} does not get on: {now.settled} of {now.total}.")
        time.sleep(0.2)
        job.refresh_from_db()
    ends = {state.value: number for state, number in now.by_state.items() if number}
    say(f"Augmentations: {', '.join(f'{number} {state}' for state, number in ends.items())}")
    if now.under_way:
        cancel(job)
        say(f"{job.name!r} is at its cap of {job.cap_calls} calls; the rest is cancelled.")
    lost = job.augmentations.filter(state__in=(State.FAILED, State.CANCELLED))
    rest = job.scenarios.exclude(pk__in=lost.values("scenario")).values_list("slug", flat=True)
    reasons = "; ".join(sorted(set(lost.values_list("reason", flat=True)) - {""}))
    # The stand-ins have no cap, and never fail.
    if not rest or (now.failed and job.cap_calls is None):
        raise DemoFailed(reasons or f"{job.name!r} has no scenario that all of it have done.")
    if now.failed:
        say(f"Left out are the scenarios of what failed: {reasons}")
    return list(rest)


def start_drives() -> list[int]:
    """Have a few scenarios driven by the workers, before the change and with the reference.

    Returns:
        The keys of the drives.
    """
    rows = models.Scenario.objects.filter(slug__in=demo.list_slugs(DRIVEN_PER_TYPE))
    waiting = [pk for row in rows for pk in plan_scenario(scenario=row, options=Options())]
    enqueue_simulations(waiting)
    return waiting


def wait_for(count: Callable[[], int], look: Callable[[], None]) -> int:
    """Wait until nothing is left, or no less for STUCK_S; returns how much is."""
    before, give_up_at = math.inf, 0.0
    while left := count():
        look()
        if left < before:
            before, give_up_at = left, time.monotonic() + STUCK_S
        elif time.monotonic() > give_up_at:
            break
        time.sleep(0.5)
    return left


def open_for_votes(scenarios: list[str], own: OwnModel | None = None) -> Study:
    """Return the study that people try voting in, which is opened where it is not there."""
    if own is None:
        return open_to_try(OPEN_STUDY, *choose_visible(scenarios))
    # Of a few pairs most are decided already.
    return open_to_try(OPEN_STUDY_WITH_MODEL, own.rated, scenarios, 2 * len(scenarios))


def vote_and_rate(
    scenarios: list[str], folder: Path, own: OwnModel | None = None
) -> tuple[str, list[Path]]:
    """Return the table of a study with simulated votes, and the files that it is written to."""
    if own is None:
        study = demo.hold_study(scenarios=scenarios)
    else:
        name = f"Demo with {own.name[:80]} (simulated votes)"
        study = demo.hold_study(scenarios=scenarios, name=name, contestants=own.rated)
    table = leaderboard_table(study.snapshots.latest("made_at"))
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for chosen in FORMATS.values():
        files.append(folder / f"leaderboard.{chosen.suffix}")
        write_whole(files[-1], chosen.write(table))
    return plain_text(table), files


def choose_visible(scenarios: list[str]) -> tuple[tuple[str, ...], list[str], int]:
    """Return contestants, scenarios on which each two are VISIBLE_M apart, and so many pairs.

    Those three or four with most pairs up to YOUR_VOTES, if possible with something that moves;
    then those with the reference, and the fewest.
    """
    rows = models.Augmentation.objects.filter(scenario__slug__in=scenarios, state=State.DONE)
    cells = {
        (row.scenario.slug, row.contestant.slug): row
        for row in rows.select_related("scenario", "contestant")
    }
    apart = set(pairs_apart(cells, VISIBLE_M))
    moving = set(demo.list_slugs(None, "moving"))
    slugs = sorted({slug for _, slug in cells})

    def list_apart(chosen: tuple[str, ...]) -> list[str]:
        pairs = list(combinations(chosen, 2))
        return [
            one for one in scenarios if all((one, first, other) in apart for first, other in pairs)
        ]

    def rank(chosen: tuple[str, ...]) -> tuple[int, bool, bool, int]:
        shown = list_apart(chosen)
        pairs = min(math.comb(len(chosen), 2) * len(shown), YOUR_VOTES)
        return pairs, not moving.isdisjoint(shown), REFERENCE in chosen, -len(chosen)

    sets = (chosen for size in (3, 4) for chosen in combinations(slugs, size))
    best = max(sets, key=rank, default=demo.RATED)
    shown = list_apart(best)
    if not shown:
        return best, scenarios, 2 * len(scenarios)
    return best, shown, math.comb(len(best), 2) * len(shown)


def open_to_try(name: str, contestants: Sequence[str], scenarios: list[str], pairs: int) -> Study:
    """Return a study for the expert, opened where it is not there.

    A film is among the first three pairs if it has any.

    Args:
        name: Of the study.
        contestants: Who is compared.
        scenarios: On what.
        pairs: At least so many can be shown.
    """
    if earlier := Study.objects.filter(name=name).first():
        return earlier
    votes = min(YOUR_VOTES, pairs)
    values = demo.study_asked(name, scenarios, contestants) | {"experts": ["expert"]}
    moves = models.Scenario.objects.filter(slug__in=scenarios, catalogue_set="moving").exists()
    seeds = range(demo.SEED, demo.SEED + (SEEDS_TRIED if moves else 1))
    for seed in seeds:
        with transaction.atomic():
            plan = StudyPlan.read(values | {"votes_per_expert": votes, "seed": seed})
            study = open_study(plan)
            first = study.matchups.filter(position__lte=3, scenario__catalogue_set="moving")
            if seed == seeds[-1] or first.exists():
                break
            transaction.set_rollback(True)
    draw_pictures(study)
    return study


def login_lines() -> list[str]:
    """Return a line for each account of the demo that still has the demo's password."""
    names = [username for username, _ in PEOPLE]
    return [
        f"  sign in as {user.username:8} password {PASSWORD}"
        for user in User.objects.filter(username__in=names, is_active=True).order_by("pk")
        if user.check_password(PASSWORD)
    ]
