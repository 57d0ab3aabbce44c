"""Ctrl-C and SIGTERM: they always end the command, and what the command then says of its files is true.

Either raises KeyboardInterrupt wherever Python happens to be. In a callback that JAX or a destructor runs, the
exception is printed and lost, and the command would go on; so it is kept in mind, raised again where that is safe, and
asked for before anything is put in place.
"""

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

NOTHING = "nothing was written"
SIGNALS = signal.SIGINT, signal.SIGTERM  # of a person and of a job scheduler
_SOON = 0.02  # seconds in which Python is out of the callback


@dataclass
class State:
    """Interruption state of the running command."""

    requested: bool = False  # a signal came
    delayed: bool = False  # it has to wait
    written: str = NOTHING  # what is on the disk
    before: Any = None  # what the signals did before `listening`, None where nothing listens


state = State()


@contextmanager
def listening() -> Iterator[None]:
    """Handle both signals during a block; changes nothing outside the main thread."""
    _forget()
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    state.before, hook = [signal.signal(each, _interrupted) for each in SIGNALS], sys.unraisablehook
    sys.unraisablehook = _lost
    try:
        yield
    finally:
        sys.unraisablehook = hook
        _restore()
        _forget()  # what a Python program runs next was not interrupted


@contextmanager
def importing() -> Iterator[None]:
    """Restore the earlier handling of both signals during a block: an exception could be lost in a module import."""
    if state.before is None:
        yield
        return
    _restore()
    try:
        yield
    finally:
        for each in SIGNALS:
            signal.signal(each, _interrupted)


def note(written: str) -> None:
    """Set the text on the files on the disk for the message of an interruption."""
    state.written = written
    check()


def check() -> None:
    """Raises KeyboardInterrupt where an earlier one was lost."""
    if state.requested and not state.delayed:
        raise KeyboardInterrupt


@contextmanager
def delayed(then: str) -> Iterator[None]:
    """Delay both signals to the end of a block that must not be left half done; `then` describes the files after it."""
    check()
    state.delayed = True
    try:
        yield
        state.written = then
    finally:
        state.delayed = False
    check()


def _forget() -> None:
    state.requested, state.delayed, state.written, state.before = False, False, NOTHING, None


def _restore() -> None:
    for each, before in zip(SIGNALS, state.before):
        signal.signal(each, before)


def _interrupted(*_) -> None:
    state.requested = True
    check()


def _lost(unraisable) -> None:
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        again = threading.Timer(_SOON, _thread.interrupt_main)  # until it is raised where it can pass
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(unraisable)
