"""What the voting benchmark found, as a table and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bench.report import table

CLIENTS, TURNS = 8, 50


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """One setup: medians over the runs, memory after them.

    Attributes:
        cpu_ms: Processor time of the web workers a vote, None where it was not measured.
        page_kb: Scripts and styles of the page, None where it was not weighed.
        is_quoted: Measured elsewhere, not in this run.
    """

    name: str
    per_second: float
    median_ms: float
    p95_ms: float
    max_ms: float
    errors: int
    cpu_ms: float | None
    pss_mb: float
    page_kb: float | None
    is_quoted: bool = False


def _elsewhere(name: str, *, rate: float, median: float, p95: float, most: float) -> Figures:
    return Figures(
        name=name,
        per_second=rate,
        median_ms=median,
        p95_ms=p95,
        max_ms=most,
        errors=0,
        cpu_ms=None,
        pss_mb=281,
        page_kb=7800,
        is_quoted=True,
    )


ELSEWHERE = [
    _elsewhere(
        "Label Studio as pip leaves it, SQLite", rate=15.5, median=312, p95=1448, most=5552
    ),
    _elsewhere("Label Studio, PostgreSQL, gunicorn 2x4", rate=21, median=361, p95=537, most=749),
]
"""Measured on 2026-11-20 on 2 cores, for machines on which Label Studio can't be installed."""


def section(found: Sequence[Figures], before: str, runs: int) -> str:
    """The words and tables under our heading."""
    head = ["", "votes/s", "median ms", "p95 ms", "max ms", "errors", "CPU ms a vote"]
    head += ["MB (PSS) a worker", "JS + CSS kB"]
    by_name = {figures.name: figures for figures in found}
    lines = [_line(figures) for figures in found]
    ours_first = found[1], by_name[ELSEWHERE[1].name]
    said = (
        f"`make bench`: {CLIENTS} clients, {TURNS} votes each a run, medians of {runs} runs; one "
        "vote is what it costs the server: ours stores it and answers with the next pair, Label "
        "Studio 1.23.2 hands out the next task and stores the annotation. Each product alone on "
        f"the machine's own network, {before}. Ours: gunicorn "
        "with 2 workers of 4 threads."
    )
    quoted = any(figures.is_quoted for figures in found)
    more = (
        "\n\nLabel Studio could not be installed here; its rows are quoted from a measurement "
        "elsewhere (2026-11-20, 2 cores, the same procedure)."
        if quoted
        else ""
    )
    return f"{said}{more}\n\n{table(head, lines)}\n\n{_verdict(*ours_first)}"


def _line(figures: Figures) -> list[str]:
    name = figures.name + (" (measured elsewhere)" if figures.is_quoted else "")
    cpu = "–" if figures.cpu_ms is None else f"{figures.cpu_ms:.1f}"
    page = "–" if figures.page_kb is None else f"{figures.page_kb:,.0f}"
    times = [f"{ms:,.0f}" for ms in (figures.median_ms, figures.p95_ms, figures.max_ms)]
    counts = [f"{figures.errors}", cpu, f"{figures.pss_mb:.0f}", page]
    return [name, f"{figures.per_second:.0f}", *times, *counts]


def _verdict(mine: Figures, theirs: Figures) -> str:
    """Return the ratios of the two on PostgreSQL in words."""
    rate, time = mine.per_second / theirs.per_second, theirs.median_ms / mine.median_ms
    ratios = (
        f"On PostgreSQL ours takes {rate:.1f} times as many votes a second as Label Studio behind "
        f"the same gunicorn, at a median {time:.1f} times shorter, with "
        f"{theirs.pss_mb / mine.pss_mb:.1f} times less memory a worker"
    )
    if mine.page_kb and theirs.page_kb:
        ratios += f" and a page {theirs.page_kb / mine.page_kb:,.0f} times lighter"
    return f"{ratios}."
