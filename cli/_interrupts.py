"""Ctrl-C that no compiled library can swallow.

A KeyboardInterrupt that arrives while such a library calls back into Python may be dropped by it.
So the handler also notes that it came, and whatever counts items asks.
"""

from __future__ import annotations

import signal
import threading

_came = threading.Event()


def install() -> None:
    """Take over SIGINT, unless the shell has it ignored (as of jobs in the background)."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)


def check() -> None:
    """Raise KeyboardInterrupt if one came, however long ago."""
    if _came.is_set():
        raise KeyboardInterrupt


def _interrupt(*_: object) -> None:
    _came.set()
    raise KeyboardInterrupt
