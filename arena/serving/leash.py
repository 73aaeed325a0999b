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


def die_with(parent: int) -> None:
    """Have Linux kill this process when its parent ends, however it ends; survives exec.

    Raises:
        SystemExit: The parent is gone already.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        raise SystemExit("the process that asked for this program is gone already")


def main(arguments: list[str]) -> None:
    """Become the program after `--`."""
    parent, _, *program = arguments
    die_with(int(parent))
    os.execvp(program[0], program)


if __name__ == "__main__":
    main(sys.argv[1:])
