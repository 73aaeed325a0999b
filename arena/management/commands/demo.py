"""`manage.py demo`: the main job on the catalogue, unattended, then served."""

import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from django.conf import settings
from django.core.management import call_command
from django.core.management.base import CommandError

from arena.management import demo
from arena.management.commands.serve import INTERRUPTED
from arena.models import Snapshot
from arena.serving.stack import Web, background, hold_alone, missing_stand_ins, web_server
from arena.serving.supervisor import Supervisor
from arena.shell.sending import send_charts
from arena.site.demo import JOB, launch_job, list_slugs
from augment.services import TerminalCommand, at_least
from augment.services.endpoints import EndpointRequest

STOPPED = "The demo was stopped before it was done; started again, it goes on from there."


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
            with hold_alone():
                self._run(options, serve=not options["no_serve"])
        except KeyboardInterrupt:
            raise CommandError(STOPPED, returncode=INTERRUPTED) from None

    def _run(self, options: Mapping[str, Any], *, serve: bool) -> None:
        started, say = time.monotonic(), self.stdout.write
        web = Web(host=options["host"], port=options["port"])
        server = [web_server(web)] if serve else []
        call_command("prepare", verbosity=0)
        own = None
        if options["endpoint"]:
            request = EndpointRequest(base_url=options["endpoint"], key_variable=options["key"])
            own = demo.add_model(request, options["model"])
        demo.prepare(say)
        scenarios = [*list_slugs(options["per_type"]), *list_slugs(1, "moving")]
        jobs = [launch_job(scenarios=scenarios, leave_out=own.contestants if own else ())]
        if own is not None:
            chosen = scenarios if options["scenarios"] == "all" else list_slugs(1)
            jobs.append(demo.launch_model(own, chosen, say))
        supervisor = Supervisor([*background(concurrency=4), *server], self._keep)
        with supervisor.signals():
            try:
                supervisor.start()
                look = partial(_look_at, supervisor)
                for job in jobs:  # the last one's scenarios are those of the studies
                    scenarios = demo.finish(job, say, look)
                text, files = demo.vote_and_rate(scenarios, settings.VAR_DIR / "demo", own)
                send_charts(Snapshot.objects.latest("made_at").pk)
                drives = demo.start_drives()
                say(f"\n{text}\n\nTables: {', '.join(map(str, files))}")
                if drives:
                    say(f"{len(drives)} drives follow in the background.")
                if not serve:
                    demo.finish_drives(drives, look)
                self._show(web, time.monotonic() - started, serve=serve)
                if serve and not supervisor.is_stopping:
                    supervisor.watch(missing_stand_ins)
            finally:
                supervisor.stop()

    def _show(self, web: Web, took_s: float, *, serve: bool) -> None:
        where = "Scenario Arena is at" if serve else "“make serve” serves it at"
        lines = [
            f"The demo took {took_s:.0f} s.\n",
            f"{where} {web.address}",
            *demo.login_lines(),
            f"  Vote as 'expert' in the study {demo.OPEN_STUDY!r}.",
            f"  See the drives as 'admin': Jobs, {JOB!r}, See the drives.",
        ]
        self.stdout.write("\n".join(lines))
        self.stdout.flush()

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
