"""`manage.py prune --older-than 180d`: remove what models were asked and answered long ago."""

from typing import Any

from django.utils import timezone

from arena.site.services import TextLoss, foresee_losses, read_age, remove_old
from augment.services.terminal import TerminalCommand

LOST = """Afterwards these answers can't be used again: the same request is asked, and paid, anew.
Transcripts, on pages and exported, are without messages and answers, and so is the study's folder.
Tokens, money, times, modifications, pictures, drives and votes stay. There is no way back but a
backup: take one first (manage.py backup FILE)."""


class Command(TerminalCommand):
    """Say what would go; with --yes let it go."""

    help = "Say which requests and answers of models are that old; with --yes remove them."

    arguments = {
        "--older-than": {"required": True, "metavar": "AGE", "help": "180d or 26w"},
        "--yes": {"action": "store_true", "help": "remove them; without it nothing is changed"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Foresee, and remove where that is wanted."""
        now = timezone.now()
        before = now - read_age(options["older_than"])
        losses = foresee_losses(before=before)
        self._tell(losses)
        if options["yes"] and losses:
            self._remove(before, now)

    def _tell(self, losses: list[TextLoss]) -> None:
        for loss in losses:
            self.stdout.write(f"{_name(loss)}: {_said(loss)}")
        if not losses:
            self.stdout.write(
                "Nothing is that old, or it belongs to a job or a study that goes on."
            )
            return
        self.stdout.write(f"\n{LOST}")

    def _remove(self, before: Any, now: Any) -> None:
        for loss, done in remove_old(before=before, now=now):
            self.stdout.write(f"{_name(loss)}: {done:,} of {loss.calls:,} are removed")


def _name(loss: TextLoss) -> str:
    if loss.job is None:
        return "Readings of instructions"
    return f"Job {loss.job.name!r} of {loss.job.created_at:%Y-%m-%d}"


def _said(loss: TextLoss) -> str:
    return (
        f"{loss.calls:,} requests and {loss.answers:,} answers, "
        f"{loss.characters / 1e6:.1f} MB of text, {loss.transcripts:,} transcripts"
    )
