"""A line that says how far long work is."""

from __future__ import annotations

import io

from arena.management.progress_line import ProgressLine


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_it_says_how_far_work_is_and_leaves_nothing() -> None:
    terminal, clock = Terminal(), iter([0.0, 0.5, 1.5, 1.6, 2.0])
    line = ProgressLine(terminal, lambda: next(clock))
    line.read(20_000)  # half a second: nothing yet
    assert terminal.getvalue() == ""
    line.read(1_240_000)
    line.read(1_260_000)  # too soon after the last
    line.drawn(40, 200)
    line.end()
    assert terminal.getvalue().split("\r\x1b[K") == [
        "",
        "reading: 1,240,000 votes",
        "drawing: 40 of 200 rounds",
        "",
    ]


def test_nothing_is_written_where_nobody_reads_along() -> None:
    pipe, clock = io.StringIO(), iter([0.0, 5.0, 9.0])
    line = ProgressLine(pipe, lambda: next(clock))
    line.read(5)
    line.end()
    assert pipe.getvalue() == ""
