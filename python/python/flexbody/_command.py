"""The command `flexbody`: the same program as that of the crate, with the same files and exit codes."""

from __future__ import annotations

import signal
import sys

from ._flexbody import run_command


def words() -> list[str]:
    """Returns the words that start this command in another process, which finds the package where this process does."""
    start = f"import sys; sys.path[:] = {sys.path!r}; from flexbody._command import main; sys.exit(main())"
    return [sys.executable, "-c", start]


def main() -> int:
    """Runs the command line of this process and returns the exit code."""
    # The program handles signals that Python does not: a KeyboardInterrupt would wait for the end of the work.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_command(["flexbody", *sys.argv[1:]])
