"""Starts the command `jaxgear`: listens to Ctrl-C and SIGTERM before the imports, which take a second.

Installed as a module beside the package (pyproject.toml), since whatever lies in a package imports all of it first.
"""

import os
import signal
import sys

_INTERRUPTED = 130  # as shells have it: 128 and the number of the signal


def main() -> None:
    """Entry point of the installed command."""

    def leave(*_) -> None:  # at once: nothing is open, and an exception could be lost in a module that starts
        os.write(2, b"jaxgear: interrupted, nothing was written\n")
        os._exit(_INTERRUPTED)

    signals = signal.SIGINT, signal.SIGTERM
    for each in signals:
        signal.signal(each, leave)
    from jaxgear.cli import main as command

    try:
        command()
    except SystemExit as end:
        for each in signals:
            signal.signal(each, signal.SIG_IGN)  # all is said and done
        if end.code == _INTERRUPTED:
            # a thread that still compiles would fall over what the interpreter takes down: a segmentation fault
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(_INTERRUPTED)
        raise


if __name__ == "__main__":
    main()
