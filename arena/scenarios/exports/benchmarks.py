"""Benchmarks as folders and zips: what entrants get."""

from pathlib import Path

from django.core.files.base import ContentFile

from arena.exports.files import WARNING, new_folder, zip_bytes
from arena.exports.written_files import FileWork, MadeFile
from arena.models import BenchmarkFile
from augment.models import BaseScene, Benchmark
from augment.services.benchmarks import benchmark_set, list_remarks, write_folder
from augment.services.judging import Source, list_warnings, scene_source


def write_benchmark(row: Benchmark, out: Path) -> tuple[str, ...]:
    """Write the folder: whole, or not at all. Returns what whoever passes it on has to know.

    Args:
        row: The benchmark.
        out: A folder that is not there yet.

    Raises:
        ArenaError: The folder is there.
        Conflict: The benchmark's scenarios have changed.
        OSError: It can't be written; nothing is left of it.
    """
    files, warnings, _ = _make_files(row)
    with new_folder(out) as folder:
        for name, content in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
    return warnings


def _make_files(row: Benchmark) -> tuple[dict[str, bytes], tuple[str, ...], list[Source]]:
    """Return the files, with what has to be said as one of them, and where scenes come from."""
    files = write_folder(benchmark_set(row))
    scenes = BaseScene.objects.filter(scenarios__benchmark_items__benchmark=row)
    sources = [scene_source(scene) for scene in scenes.defer("document", "recording").distinct()]
    if warnings := (*list_remarks(row), *list_warnings(sources)):
        files[WARNING] = ("\n".join(warnings) + "\n").encode()
    return files, warnings, sources


class BenchmarkFiles(FileWork[BenchmarkFile]):
    """Zips of benchmarks."""

    model = BenchmarkFile
    related = ("benchmark",)

    def make(self, row: BenchmarkFile, folder: Path) -> MadeFile:
        """Return the folder as a zip."""
        files, warnings, sources = _make_files(row.benchmark)
        marked = any(source.is_non_commercial for source in sources)
        return MadeFile(
            name=f"{row.benchmark.slug}-{row.benchmark.version}{'-non-commercial' * marked}.zip",
            content=ContentFile(zip_bytes(files)),
            warnings=warnings,
            marked=marked,
        )


BENCHMARK_FILES = BenchmarkFiles()
