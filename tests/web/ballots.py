"""What the tests of the voting page look at."""

from django.urls import reverse

from arena.models import Matchup
from tests.web.cast import World


def page(here: World) -> str:
    return reverse("vote", args=[here.study.code])


def following(here: World) -> Matchup:
    """What the expert judges next."""
    return here.study.matchups.filter(expert=here.expert, votes=None).earliest("position")
