"""What the tests of the voting page send and look at."""

import uuid

from django.urls import reverse

from arena.models import Matchup
from tests.web.cast import World


def page(here: World) -> str:
    return reverse("vote", args=[here.study.code])


def following(here: World) -> Matchup:
    """What the expert judges next."""
    return here.study.matchups.filter(expert=here.expert, votes=None).earliest("position")


def ballot(matchup: Matchup, outcome: str = "left", **more: object) -> dict[str, object]:
    return {"key": uuid.uuid4(), "matchup": matchup.code, "outcome": outcome, **more}
