"""`manage.py serve`: everything the product needs on one machine, until Ctrl-C."""

from typing import Any

from django.core.management import call_command
from django.core.management.base import CommandError

from arena.management.commands.demo import login_lines
from arena.people.services import make_first_link_token
from arena.serving import stack
from arena.serving.supervisor import Supervisor
from augment.services import TerminalCommand, at_least


class Command(TerminalCommand):
    """Start what is missing, serve the pages, stop all of it together."""

    help = (
        "Serve Scenario Arena on this machine: a private Redis (unless REDIS_URL is set), a "
        "worker and the web server. One Ctrl-C stops all of it."
    )

    arguments = {
        "--host": {"default": "127.0.0.1", "help": "address to listen on"},
        "--port": {"type": int, "default": 8000, "help": "port to listen on"},
        "--web-workers": {"type": at_least(1), "default": 2, "help": "web server processes"},
        "--concurrency": {"type": at_least(1), "default": 4, "help": "augmentations at once"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Run until somebody asks to stop."""
        web = stack.Web(host=options["host"], port=options["port"], workers=options["web_workers"])
        try:
            with stack.hold_alone():
                self._serve(web, options["concurrency"])
        except KeyboardInterrupt:  # before anything was started
            raise CommandError(
                "Stopped before anything ran.", returncode=stack.INTERRUPTED
            ) from None
        self.stdout.write("Everything is stopped.")

    def _serve(self, web: stack.Web, concurrency: int) -> None:
        server = stack.web_server(web)
        call_command("prepare", verbosity=0)
        supervisor = Supervisor([*stack.background(concurrency=concurrency), server], self._say)
        with supervisor.signals():
            try:
                supervisor.start()
                self.stdout.write(f"\nScenario Arena is at {web.address}  (Ctrl-C stops it)\n")
                for line in login_lines():
                    self.stdout.write(line)
                if token := make_first_link_token():
                    address = f"{web.address.rstrip('/')}/first/{token}/"
                    self.stdout.write(
                        f"Nobody is admin yet. Make the first one here, within a day:\n{address}\n"
                    )
                supervisor.watch(stack.missing_stand_ins)
            finally:
                self.stdout.write("Stopping ...")
                supervisor.stop()

    def _say(self, name: str, line: str) -> None:
        self.stdout.write(f"{name:8} | {line}")
