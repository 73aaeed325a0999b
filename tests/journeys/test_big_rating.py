"""More votes than a person should wait for: the page plans the rating, a worker computes."""

from itertools import cycle, islice
from pathlib import Path

import pytest

from arena.results.services.ratings import WHILE_WAITING
from tests.processes import machine

pytestmark = [pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]

VOTES = (
    *("a,b,model_a", "b,a,model_b", "b,a,model_a"),
    *("a,c,model_a", "c,a,model_a", "b,c,model_a", "c,b,tie"),
)
STATE = "SELECT state, progress, votes_counted, reason FROM arena_snapshot"
STANDINGS = "SELECT slug FROM arena_standing ORDER BY rating DESC"

RATE = """
import time
from django.core.management import call_command
from django.test import Client
from django.urls import reverse
from arena.models import Study
from tests.web.cast import people

call_command("import_votes", "{file}", "--name", "Many")
study = Study.objects.get()
analyst = Client(SERVER_NAME="localhost")
analyst.force_login(people()["analyst"])
page = analyst.post(reverse("study-rate", args=[study.code]), {{"rounds": 10}}, follow=True)
print(page.status_code, "The rating is being computed." in page.content.decode())
limit = time.monotonic() + 240.0
while "is being computed:" in page.content.decode() and time.monotonic() < limit:
    time.sleep(0.2)
    page = analyst.get(reverse("results", args=[study.code]))
print(page.content.decode())
"""


def votes_file(folder: Path) -> Path:
    file = folder / "many.csv"
    lines = islice(cycle(VOTES), WHILE_WAITING + 1)
    file.write_text("\n".join(["model_a,model_b,winner", *lines]) + "\n")
    return file


def test_a_rating_of_many_votes_is_computed_by_a_worker_and_shown_when_it_is_done(
    migrated: Path,
) -> None:
    with machine(database=migrated) as place:
        place.must("prepare", "--verbosity", "0")
        redis = place.redis()
        worker = place.worker(concurrency=1)
        try:
            script = RATE.format(file=votes_file(place.folder))
            ended = place.manage("shell", "--verbosity", "0", "-c", script, within_s=280.0)
        finally:
            worker.stop()
            redis.stop()
        said = ended.stdout
        assert ended.returncode == 0, said + ended.stderr
        assert "200 True" in said.splitlines()
        assert f"{WHILE_WAITING + 1} votes counted" in said
        assert "is being computed:" not in said
        assert place.rows(STATE) == [("ready", 100, WHILE_WAITING + 1, "")]
        assert [slug for (slug,) in place.rows(STANDINGS)] == ["a", "b", "c"]
        assert "work.snapshot" in worker.said()
