"""The work of arena's rows, registered with the workers; see augment.tasks."""

from arena.jobs.exports.displacement import draw_box_plots
from arena.jobs.exports.files import SCENARIO_FILES
from arena.results.exports.study_files import STUDY_FILES
from arena.results.exports.writers import draw_charts
from arena.results.services.ratings import RATINGS
from arena.scenarios.exports.benchmarks import BENCHMARK_FILES
from arena.shell.sending import send_charts
from augment.services import register
from augment.tasks import AFTERWARDS, DRAWN

register(RATINGS, BENCHMARK_FILES, SCENARIO_FILES, STUDY_FILES)
DRAWN.update(rating=draw_charts, job=draw_box_plots)
AFTERWARDS[RATINGS.name] = send_charts
