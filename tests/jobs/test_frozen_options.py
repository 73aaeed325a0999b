"""What a contestant ran with stays: at its next run, for one like it, and for rows of before."""

from __future__ import annotations

import pytest

from augment.errors import Conflict
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.running import runner
from augment.services.running.choosing import find_obstacle
from tests.jobs.scripted import Scripted, add, run
from tests.llm.json_server import serving

pytestmark = pytest.mark.django_db


def test_who_ran_with_other_prompts_is_not_run_with_these() -> None:
    with serving(Scripted()) as server:
        add(server, "a")
        run("a")
        Contestant.objects.update(frozen_options={"prompt_version": "0" * 12})
        assert "version 000000000000" in find_obstacle(Contestant.objects.get(slug="a"))
        with pytest.raises(Conflict, match="Add another contestant like it"):
            run("a")
        row = Augmentation.objects.create(
            job=GenerationJob.objects.get(),
            scenario=Augmentation.objects.get().scenario,
            contestant=Contestant.objects.get(),
            sample=2,
        )
        runner.work_on(augmentation_pk=row.pk)
        row.refresh_from_db()
        assert (row.state, len(server.bodies)) == (Augmentation.State.FAILED, 1)
        add(server, "b", seed=1)
        run("b")
