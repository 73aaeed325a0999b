#!/usr/bin/env python
"""Scenario Arena's command line: `python manage.py help` lists the commands."""

import io
import os
import sys


def main() -> None:
    """Run a command. rate_csv needs no Django, and is done before Django would be loaded."""
    # Many workers share the cores; matrices here are small, and threads would only wait.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # What `serve` and `demo` say is in a log file at once, as on a terminal.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    if sys.argv[1:2] == ["rate_csv"]:
        from arena.management.rate_csv import main as rate_csv

        sys.exit(rate_csv(sys.argv[2:]))
    from django.core.management import execute_from_command_line

    os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")
    execute_from_command_line(sys.argv)


if __name__ == "__main__":
    main()
