"""Celery tasks of arena; see augment.tasks."""

from functools import partial

from celery import shared_task
from django.contrib.auth.models import User

from arena.jobs.exports.displacement import draw_box_plots
from arena.jobs.exports.files import SCENARIO_FILES
from arena.results.exports.study_files import STUDY_FILES
from arena.results.exports.writers import draw_charts
from arena.results.services.ratings import RATINGS
from arena.scenarios.exports import BENCHMARK_FILES
from augment.models import Scenario
from augment.services.scenarios import pictures
from augment.services.work import register
from augment.tasks import AFTERWARDS, DRAWN, draw, send, sender

register(RATINGS, BENCHMARK_FILES, SCENARIO_FILES, STUDY_FILES)

send_snapshot = sender(RATINGS)
send_benchmark_file = sender(BENCHMARK_FILES)
send_scenario_file = sender(SCENARIO_FILES)
send_study_file = sender(STUDY_FILES)
send_charts = partial(send, draw, "rating")
DRAWN.update(rating=draw_charts, job=draw_box_plots)
AFTERWARDS[RATINGS.name] = send_charts


@shared_task(name="arena.draw_checks", acks_late=True, ignore_result=True)
def draw_checks(actor_pk: int) -> None:
    """Draw the attention checks that scenarios with a reference lack; again, none is left."""
    slugs = list(Scenario.objects.exclude(reference=None).values_list("slug", flat=True))
    pictures.draw_checks(scenarios=slugs, actor=User.objects.filter(pk=actor_pk).first())


def send_checks(actor_pk: int) -> None:
    """Ask a worker to draw attention checks; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; nothing is drawn until somebody asks again.
    """
    send(draw_checks, actor_pk)
