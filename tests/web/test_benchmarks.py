"""Pages of benchmarks: made with a count, written by a worker, got by who may."""

import io
import json
import zipfile
from pathlib import Path

import pytest
from django.urls import reverse
from pytest_django import Settings

from arena.models import BenchmarkFile
from arena.scenarios.exports.benchmarks import BENCHMARK_FILES
from augment.models import Benchmark
from augment.scene.codec import modification_from_document
from tests.services.test_benchmarks import add_street
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db(transaction=True)

FORM = {**{"title": "Streets", "scenarios": "street-*"}, **{"practice": "40", "seed": "1"}}


def test_it_is_counted_made_written_and_got(settings: Settings, tmp_path: Path) -> None:
    settings.MEDIA_ROOT = tmp_path
    for number in range(1, 6):
        add_street(number)
    cast = people()
    admin, researcher = signed_in(cast["admin"]), signed_in(cast["researcher"])
    counted = admin.post(reverse("benchmark-new"), FORM | {"title": "", "estimate": "1"})
    counts = {line.label: (line.practice, line.test) for line in counted.context["counts"]}
    assert counts == {"Easy": (2, 3), "Medium": (0, 0), "Hard": (0, 0), "All": (2, 3)}
    assert not Benchmark.objects.exists()
    made = admin.post(reverse("benchmark-new"), FORM)
    row = Benchmark.objects.get()
    assert made["Location"] == reverse("benchmark", args=[row.code])
    waiting = researcher.get(made["Location"]).content.decode()
    assert all(text in waiting for text in ("It waits for a worker", 'id="live" data-live'))
    assert researcher.get(reverse("benchmark-file", args=[row.code])).status_code == 404
    BENCHMARK_FILES.perform(BenchmarkFile.objects.get().pk)
    page = researcher.get(made["Location"]).content.decode()
    assert all(text in page for text in (row.checksum, "streets-1.zip", "5 tasks", "street-3"))
    assert "data-live" not in page
    answer = researcher.get(reverse("benchmark-file", args=[row.code]))
    check_no_test_reference(row, b"".join(answer), page)
    researcher.post(reverse("benchmark-retired", args=[row.code]))
    row.refresh_from_db()
    assert row.retired_at is None, "that is for admins"
    admin.post(reverse("benchmark-retired", args=[row.code]))
    assert "retired" in admin.get(reverse("benchmarks")).content.decode()


def check_no_test_reference(row: Benchmark, content: bytes, page: str) -> None:
    """No document of a reference of the test is in the zip or on the page, nor a number of it."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    practice = {item.scenario.slug for item in row.items.filter(split="practice")}
    assert len(practice) == 2
    references = {name for name in files if name.startswith("references/")}
    assert references == {f"references/{slug}.json" for slug in practice}
    for item in row.items.select_related("scenario"):
        (agent,) = modification_from_document(item.scenario.reference).added
        where = {name for name, written in files.items() if str(agent.x_m).encode() in written}
        slug = item.scenario.slug
        assert where == ({f"references/{slug}.json"} if slug in practice else set())
        whole = json.dumps((item.scenario.reference or {})["add"]).encode()
        assert not [name for name, written in files.items() if whole in written and not where]
        assert str(agent.x_m) not in page


def test_what_is_wrong_is_told_at_its_field() -> None:
    admin = signed_in(people()["admin"])
    answer = admin.post(reverse("benchmark-new"), FORM | {"title": ""})
    assert answer.status_code == 422
    assert list(answer.context["form"].errors) == ["title"]
    answer = admin.post(reverse("benchmark-new"), FORM | {"scenarios": "no", "estimate": "1"})
    assert answer.status_code == 200
    assert "Unknown scenario" in answer.content.decode()
