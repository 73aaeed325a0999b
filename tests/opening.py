"""Opening a study by its fields, with nothing on top of its votes unless told otherwise."""

from typing import Any

from arena.models import Study
from arena.studies.services import opening
from arena.studies.services.plan import StudyPlan


def open_study(**fields: Any) -> Study:
    """Open what a plan of these fields asks for; alike pairs are shown and nothing is repeated."""
    plain = {"repeats": 0.0, "show_alike": True}
    return opening.open_study(StudyPlan.read(plain | fields))
