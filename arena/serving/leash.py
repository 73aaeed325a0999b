"""Start a program that dies with whoever started it.

`python -m arena.serving.leash PARENT_PID -- PROGRAM [ARGUMENT ...]`

It is a launcher of its own because a hook between fork and exec is unsafe in a process with
threads. Elsewhere than on Linux the program just runs, and an orderly stop still ends it.
"""

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def die_with_parent() -> None:
    """Have Linux kill this process when its parent ends, however it ends; survives exec."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def main(arguments: list[str]) -> None:
    """Become the program after `--`."""
    parent, _, *program = arguments
    die_with_parent()
    if os.getppid() != int(parent):
        raise SystemExit("the process that asked for this program is gone already")
    os.execvp(program[0], program)


if __name__ == "__main__":
    main(sys.argv[1:])
