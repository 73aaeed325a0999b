"""What a contestant ran with stays: at its next run, for one like it, and for rows of before."""

from __future__ import annotations

import pytest

from augment.errors import Conflict
from augment.models import Augmentation, Contestant, EndpointModel, GenerationJob
from augment.prompts.fill import prompt_version
from augment.services.endpoints import contestants
from augment.services.endpoints.treatments import options_of
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
        contestants.add_like(slug="b", like="a", name="B")
        run("b")


def test_a_contestant_like_another_one_asks_as_that_one_did() -> None:
    """Whatever has become known of the model, and whatever the defaults are by now."""
    with serving(Scripted()) as server:
        add(server, "a", "fc", temperature=0.7)
        run("a")
        ran = options_of(Contestant.objects.get(slug="a")).to_document()
        old = ran | {"radius_m": 60.0, "max_output_tokens": 900, "prompt_version": "0" * 12}
        Contestant.objects.filter(slug="a").update(frozen_options=old)
        EndpointModel.objects.update(native_tools=True)
        made = contestants.add_like(slug="b", like="a")
        run("b")
    made.refresh_from_db()
    assert made.frozen_options == old | {"prompt_version": prompt_version()}
    assert made.frozen_options["protocol"] == "prompt"
    assert made.name == "m FC (temperature 0.7) at here"
    other = contestants.add_like(slug="c", like="a", changes={"variant": "otm"})
    assert other.options == {"temperature": 0.7, "radius_m": 60.0, "max_output_tokens": 900}
