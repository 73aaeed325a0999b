"""The drives behind the two pictures of a pair, for the one who judges it."""

from __future__ import annotations

from typing import Any
from uuid import UUID

from django.contrib.auth.models import User

from arena.errors import NotYours
from arena.models import Matchup
from arena.people.queries import role_of
from augment.models import Simulation
from augment.services.judging.simulations import blind_drive


def drives_of_pair(*, user: User, code: UUID) -> dict[str, dict[str, Any]] | None:
    """Both drives of one of the user's own pairs, as "a" and "b"; admins may look at all.

    They say nothing of who changed the scene, nor what the planner made of it. None where the
    study plays none on this scenario.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
    """
    rows = Matchup.objects.select_related("study", "scenario").only(
        "left", "right", "expert", "scenario__slug", "study__allow_replay", "study__rules"
    )
    matchup = rows.filter(code=code).first()
    if matchup is None or (matchup.expert_id != user.pk and role_of(user) != "admin"):
        raise NotYours("This pair is not shown to you.")
    played = matchup.study.rules.get("replays", {}) if matchup.study.allow_replay else {}
    if matchup.scenario.slug not in played.get("scenarios", ()):
        return None
    drives = Simulation.objects.filter(
        augmentation__in=(matchup.left_id, matchup.right_id),
        state=Simulation.State.DONE,
        **{name: played[name] for name in ("planner", "offsets", "is_reactive")},
    )
    drive_by_picture = {row.augmentation_id: row for row in drives.defer("document")}
    if len(drive_by_picture) < 2:
        return None
    sides = {"a": matchup.left_id, "b": matchup.right_id}
    return {side: blind_drive(drive_by_picture[key]) for side, key in sides.items()}
