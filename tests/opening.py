"""Opening a study by its fields, with nothing on top of its votes unless told otherwise."""

from typing import Any

from arena.models import Study
from arena.studies.services import opening
from arena.studies.services.plan import StudyPlan
from arena.voting.services.drawing import show_own_pictures


def open_study(**fields: Any) -> Study:
    """Open what a plan of these fields asks for; alike pairs are shown and nothing is repeated.

    Its pairs show the pictures of the answers themselves: nothing is drawn.
    """
    plain = {"repeats": 0.0, "show_alike": True}
    study = opening.open_study(StudyPlan.read(plain | fields))
    show_own_pictures(study)
    return study
