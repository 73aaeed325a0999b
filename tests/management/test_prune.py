"""`manage.py prune`: what goes is said first, what is needed stays, and the numbers stay."""

from datetime import timedelta
from io import StringIO
from typing import Any

import pytest
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import call_command
from django.utils import timezone

from arena.models import Study
from augment.models import Augmentation, Event, GenerationJob, ModelCall
from augment.services.running import jobs, runner
from augment.services.running.jobs import JobRequest
from tests import study_rows
from tests.jobs.models import Model, llama_job

pytestmark = pytest.mark.django_db


def prune(*arguments: str, age: str = "180") -> str:
    said = StringIO()
    call_command("prune", "--older-than", age, *arguments, stdout=said)
    return said.getvalue()


def old_job(*, scenarios: int = 2) -> GenerationJob:
    """A job of one model, done 200 days ago."""
    job = llama_job(scenarios=scenarios)
    for row in job.augmentations.all():
        runner.Augmentations(Model()).perform(row.pk)
    age()
    job.refresh_from_db()
    return job


def age(days: int = 200) -> None:
    ModelCall.objects.update(started_at=timezone.now() - timedelta(days=days))


def stored() -> list[dict[str, Any]]:
    return [dict(row) for row in ModelCall.objects.order_by("pk").values()]


def test_without_yes_it_says_what_would_be_lost_and_changes_nothing() -> None:
    old_job()
    before, said = stored(), prune()
    assert "Requests with their answers: 2" in said
    for word in ("asked, and paid, anew", "exported", "backup"):
        assert word in said
    assert stored() == before
    assert not Event.objects.filter(verb="prune").exists()


def test_with_yes_words_go_and_numbers_and_results_stay() -> None:
    old_job()
    before = stored()
    results = list(Augmentation.objects.order_by("pk").values("state", "modification", "image"))
    assert "2 of 2 are removed" in prune("--yes")
    for was, now in zip(before, stored(), strict=True):
        assert now["removed_at"] is not None
        assert (now["answer"], now["extras"], now["request_hash"]) == ("", None, "")
        assert "messages" not in now["request"]
        assert now["request"]["model"] == was["request"]["model"]
        gone = {"answer", "extras", "request", "request_hash", "removed_at"}
        for name in was.keys() - gone:
            assert now[name] == was[name], name
    assert list(Augmentation.objects.order_by("pk").values("state", "modification", "image")) == (
        results
    )
    event = Event.objects.get(verb="prune")
    assert event.after is not None
    assert event.after["calls"] == 2
    assert "Nothing is that old" in prune("--yes"), "a second run finds nothing"
    assert Event.objects.filter(verb="prune").count() == 1


def test_what_goes_on_keeps_everything() -> None:
    job = old_job(scenarios=3)
    rows = list(job.augmentations.order_by("pk"))
    study = study_rows.a_study()
    study.matchups.filter(pk=study_rows.matchups_of(study, "eva")[0].pk).update(left=rows[0])
    ModelCall.objects.filter(attempt__augmentation=rows[1]).update(started_at=timezone.now())
    assert "answers: 1" in prune()
    for state in (*GenerationJob.HELD, GenerationJob.State.RUNNING):
        GenerationJob.objects.filter(pk=job.pk).update(state=state)
        assert "Nothing is that old" in prune(), state
    GenerationJob.objects.filter(pk=job.pk).update(state=job.state)
    prune("--yes")
    kept = ModelCall.objects.filter(removed_at=None).values_list(
        "attempt__augmentation", flat=True
    )
    assert set(kept) == {rows[0].pk, rows[1].pk}
    Study.objects.filter(pk=study.pk).update(state=Study.State.CLOSED)
    age()
    assert "answers: 2" in prune()


def test_the_source_of_an_answer_that_an_open_study_shows_stays() -> None:
    old_job(scenarios=1)
    again = jobs.launch(JobRequest(name="2", contestants=["llama"], scenarios=["street-1"]))
    row = again.augmentations.get()
    runner.Augmentations(Model()).perform(row.pk)
    age()
    assert ModelCall.objects.filter(served_from__isnull=False).count() == 1
    study = study_rows.a_study()
    study.matchups.filter(pk=study_rows.matchups_of(study, "eva")[0].pk).update(left=row)
    assert "Nothing is that old" in prune()


def test_images_go_with_the_last_call_that_names_them() -> None:
    old_job(scenarios=2)
    first, second = ModelCall.objects.order_by("pk")
    shared, own = "a" * 64, "b" * 64
    for call, digests in ((first, (shared, own)), (second, (shared,))):
        parts = [{"type": "image_url", "image_url": {"url": f"sha256:{one}"}} for one in digests]
        call.request["messages"] = [{"role": "user", "content": parts}]
        call.role = "viewer"
        call.save()
    for digest in (shared, own):
        default_storage.save(f"asked/{digest}.png", ContentFile(b"png"))
    ModelCall.objects.filter(pk=second.pk).update(started_at=timezone.now())
    prune("--yes")
    assert default_storage.listdir("asked")[1] == [f"{shared}.png"]
    age()
    prune("--yes")
    assert default_storage.listdir("asked")[1] == []
