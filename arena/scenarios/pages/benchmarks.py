"""Pages of benchmarks: what there is to enter, and making a new version."""

import uuid
from typing import Any

from django import forms
from django.contrib import messages
from django.db import transaction
from django.http import FileResponse, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render

from arena.exports.written_files import ask_for
from arena.models import BenchmarkFile
from arena.scenarios.queries import count_tasks, list_benchmarks
from arena.shell import access, accounts, acts, pictures
from arena.shell.forms import RequestForm
from augment.errors import Conflict
from augment.models import Benchmark
from augment.services import read_request, retire, to_inputs
from augment.services.benchmarks import (
    BenchmarkRequest,
    benchmarks,
    make_benchmark,
    plan_benchmark,
)


class BenchmarkForm(RequestForm):
    """A new version; scenarios are words, as commands take them."""

    inputs = tuple(field for field in to_inputs(BenchmarkRequest) if field.name != "slug")
    scenarios = forms.CharField(
        max_length=60_000,
        help_text=next(field.help for field in inputs if field.name == "scenarios"),
    )

    def clean_scenarios(self) -> list[str]:
        """Return the words."""
        return str(self.cleaned_data["scenarios"]).split()


@access.page_for(*access.BENCHMARK_READERS)
def benchmarks_page(request: HttpRequest) -> HttpResponse:
    """List every version."""
    return render(request, "benchmarks/list.html", {"rows": list_benchmarks()})


@access.form_for(access.ADMIN)
def new_benchmark_page(request: HttpRequest) -> HttpResponse:
    """Choose scenarios, see how many of which kind they are, make the version."""
    form, more = BenchmarkForm(request.POST or None), dict[str, Any]()
    if "estimate" in request.POST:
        form.is_valid()
        form.errors.pop("title", None)
        if not form.errors:
            with acts.refusals_in(form, "scenarios"):
                wanted = read_request(BenchmarkRequest, form.cleaned_data, title="")
                planned = plan_benchmark(wanted)
                counts = count_tasks((task.split, task.stratum) for task in planned)
                more = {"counts": counts, "total": len(planned)}
    elif form.is_bound and form.is_valid():
        with acts.refusals_in(form, "scenarios"), transaction.atomic():
            row = make_benchmark(
                read_request(BenchmarkRequest, form.cleaned_data), access.get_user(request)
            )
            _ask_for_zip(request, row)
            messages.success(request, f"{row} is made; a worker writes its folder.")
            return redirect("benchmark", code=row.code)
    status = 422 if form.errors and "estimate" not in request.POST else 200
    return render(request, "benchmarks/new.html", {"form": form, **more}, status=status)


@access.page_for(*access.BENCHMARK_READERS)
def benchmark_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show how many tasks there are of which kind, and where to get them."""
    row = get_object_or_404(Benchmark.objects.select_related("made_by"), code=code)
    items = row.items.select_related("scenario").defer("scenario__reference")
    file = _newest_file(row)
    context = {
        "benchmark": row,
        "items": items,
        "counts": count_tasks((item.split, item.stratum) for item in items),
        "newest": Benchmark.objects.filter(slug=row.slug, version__gt=row.version).first(),
        "file": file,
        "remarks": benchmarks.list_remarks(row),
        "is_staff": accounts.top_role(request.user) in access.STAFF,
        **acts.wait_for_workers(waits=file is not None and file.is_waiting),
    }
    return render(request, "benchmarks/benchmark.html", context)


@access.act_for(*access.BENCHMARK_READERS, back="benchmark")
def write_zip(request: HttpRequest, code: uuid.UUID) -> None:
    """Leave the folder to a worker; twice does no harm."""
    with transaction.atomic():
        row = get_object_or_404(Benchmark, code=code)
        file = _newest_file(row)
        if file is not None and file.state == BenchmarkFile.State.READY:
            raise Conflict("The folder is written already.")
        _ask_for_zip(request, row)
        messages.success(request, "A worker writes the folder; it is offered here when ready.")


def _newest_file(row: Benchmark) -> BenchmarkFile | None:
    """Return the newest zip that is ready, else the newest."""
    files = row.files.order_by("-pk")
    return files.filter(state=BenchmarkFile.State.READY).first() or files.first()


def _ask_for_zip(request: HttpRequest, row: Benchmark) -> None:
    file = ask_for(BenchmarkFile(benchmark=row, asked_by=access.get_user(request)), row)
    acts.send_later(request, file)


@access.page_for(*access.BENCHMARK_READERS)
def download_benchmark(request: HttpRequest, code: uuid.UUID) -> FileResponse:
    """Answer with the newest zip that is ready."""
    ready = BenchmarkFile.objects.filter(benchmark__code=code, state=BenchmarkFile.State.READY)
    return pictures.file_response(ready.order_by("pk").last())


@access.act_for(access.ADMIN, back="benchmark")
def retire_benchmark(request: HttpRequest, code: uuid.UUID) -> None:
    """Retire a version, or take that back."""
    row = get_object_or_404(Benchmark, code=code)
    retire(row, actor=access.get_user(request), is_retired=request.POST.get("retired") != "no")
