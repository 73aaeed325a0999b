"""Two machines that share no folder work on one job, and a third sees all of it."""

import zipfile

import pytest

from tests.hosts import services
from tests.processes import wait_until

pytestmark = [pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]

SEED = """
from django.core.management import call_command
call_command("migrate", verbosity=0)
from augment.services.endpoints import contestants
from tests.jobs.rows import add_scenario
contestants.ensure_builtin()
for number in range(8):
    add_scenario(f"street-{number}")
"""
DONE = "SELECT COUNT(*) FROM augment_augmentation WHERE state = 'done'"
DONE_BY = "SELECT worker, COUNT(*) FROM augment_attempt WHERE outcome = 'done' GROUP BY worker"


def test_hosts_share_a_job_through_services_alone() -> None:
    with services() as around:
        clerk, *hosts = (around.host(name) for name in ("clerk", "first", "second"))
        clerk.must("shell", "--verbosity", "0", "-c", SEED)
        workers = [host.worker(concurrency=1) for host in hosts]
        try:
            clerk.must(
                "generate", "--contestants", "reference", "rule-placer", "--scenarios", "all"
            )
            wait_until(lambda: clerk.rows(DONE) == [(16,)], what="everything is done")
        finally:
            for worker in workers:
                worker.stop()
        shares = dict(clerk.rows(DONE_BY))
        assert len(shares) == 2, shares
        assert sum(shares.values()) == 16, "each row was done once"
        images = {name for (name,) in clerk.rows("SELECT image FROM augment_augmentation")}
        assert images <= {name.removeprefix("arena/") for name in around.bucket.names()}
        assert not any(list(host.folder.glob("media/**/*.png")) for host in (clerk, *hosts))
        kept = clerk.folder / "backup.zip"
        clerk.must("backup", str(kept))
        with zipfile.ZipFile(kept) as archive:
            names = {name.removeprefix("media/") for name in archive.namelist()}
        assert images <= names
