"""The command `flexbody`: the same program as that of the crate, with the same files and exit codes."""

from __future__ import annotations

import os
import signal
import sys

from ._flexbody import run_command


def main() -> int:
    """Runs the command line of this process and returns the exit code."""

    def ended(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    # Both leave no unfinished file.
    signal.signal(signal.SIGINT, ended)
    signal.signal(signal.SIGTERM, ended)
    try:
        return run_command(["flexbody", *sys.argv[1:]])
    except KeyboardInterrupt:
        line_end = "\n" if sys.stderr.isatty() else ""
        sys.stderr.write(f"{line_end}interrupted: no unfinished file is left\n")
        sys.stderr.flush()
        # At once: the work goes on until the process has ended.
        os._exit(130)
