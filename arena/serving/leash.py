"""Start a program that dies with whoever started it.

`python -m arena.serving.leash PARENT_PID -- PROGRAM [ARGUMENT ...]`

Linux sends SIGKILL to this process when its parent ends, however it ends; the setting survives
exec. It is a launcher of its own because a hook between fork and exec is unsafe in a process with
threads. Elsewhere than on Linux the program just runs, and an orderly stop still ends it.
"""

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def main(arguments: list[str]) -> None:
    """Become the program after `--`."""
    parent, separator, *program = arguments
    if separator != "--" or not program:
        raise SystemExit(
            "usage: python -m arena.serving.leash PARENT_PID -- PROGRAM [ARGUMENT ...]"
        )
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != int(parent):
            raise SystemExit("the process that asked for this program is gone already")
    os.execvp(program[0], program)


if __name__ == "__main__":
    main(sys.argv[1:])
