"""The work of arena's rows, registered with the workers; see augment.tasks."""

from arena.jobs.exports.displacement import draw_box_plots
from arena.jobs.exports.files import SCENARIO_FILES
from arena.models import Study
from arena.results.exports.study_folder import STUDY_FILES
from arena.results.exports.writers import draw_charts
from arena.results.services.ratings import RATINGS
from arena.scenarios.exports.benchmarks import BENCHMARK_FILES
from arena.shell.sending import send_charts
from arena.voting.services.drawing import draw_pictures
from augment.services import register
from augment.tasks import AFTERWARDS, DRAWN, draw, send

register(RATINGS, BENCHMARK_FILES, SCENARIO_FILES, STUDY_FILES)
PART_S = 20.0
"""So long a message draws pictures of a study, so that others get their turn."""


def draw_study(pk: int) -> None:
    """Draw pictures of a study; what is left goes by another message."""
    study = Study.objects.filter(pk=pk).first()
    if study is not None and draw_pictures(study, within_s=PART_S):
        send(draw, "study", pk)


DRAWN.update(rating=draw_charts, job=draw_box_plots, study=draw_study)
AFTERWARDS[RATINGS.name] = send_charts
