"""What the user sees beside the artifacts: errors, warnings, progress. All on standard error."""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click

from facade_tools.errors import FacadeError

from ._interrupts import check

LOGGER = "facade_tools"
PATIENCE = 1.0  # seconds before a bar appears


def start_logging(verbose: int, quiet: bool) -> None:
    """Send the library's log to standard error at the level that the options ask for."""
    level = (
        logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    )
    logger = logging.getLogger(LOGGER)
    logger.handlers = [_Handler()]
    logger.setLevel(level)
    logger.propagate = False


class ReaderLeft(Exception):
    """The reader of standard output has had enough (`facade … | head`): no error of ours."""


Message = tuple[int, str]  # level and text


class _Handler(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        show_messages([(record.levelno, record.getMessage())])


class _Collector(logging.Handler):
    def __init__(self) -> None:
        super().__init__()
        self.messages: list[Message] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append((record.levelno, record.getMessage()))


@contextmanager
def collected_log() -> Iterator[list[Message]]:
    """Keep what the library logs, so that workers' messages come out in the items' order."""
    logger = logging.getLogger(LOGGER)
    collector, handlers, level = _Collector(), logger.handlers, logger.level
    logger.handlers, logger.propagate = [collector], False
    logger.setLevel(logging.DEBUG)  # the process that shows them decides
    try:
        yield collector.messages
    finally:
        logger.handlers = handlers
        logger.setLevel(level)


def show_messages(messages: Sequence[Message]) -> None:
    """Write messages to standard error, those that the level of the log lets through."""
    threshold = logging.getLogger(LOGGER).getEffectiveLevel()
    for level, text in messages:
        if level >= threshold:
            click.echo(f"facade: {logging.getLevelName(level).lower()}: {text}", err=True)


def explain(error: BaseException, arguments: Sequence[str]) -> int:
    """Tell the user what went wrong in one line; return the exit code."""
    if isinstance(error, click.exceptions.Exit):
        return error.exit_code
    if isinstance(error, click.Abort | KeyboardInterrupt):
        click.echo("facade: interrupted", err=True)
        return 130
    if isinstance(error, ReaderLeft):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    if isinstance(error, click.ClickException):
        error.show()
        return 2
    if "--debug" in arguments:
        import traceback

        traceback.print_exception(error)
    say_error(_stage(arguments), error)
    return error.exit_code if isinstance(error, FacadeError) else 1


def say_error(stage: str, error: BaseException) -> None:
    """Write the one line of an error."""
    if isinstance(error, FacadeError):
        text = str(error)
    else:
        text = f"unexpected failure, a bug: {type(error).__name__}: {error} (--debug shows where)"
    line = " ".join(text.split())
    click.echo(f"facade {stage}: error: {line}".replace(" : ", ": "), err=True)


def _stage(arguments: Sequence[str]) -> str:
    from ._group import STAGES

    return next((word for word in arguments if word in STAGES), "")


class Progress:
    """A line on a terminal's standard error that says how far a stream is; silent elsewhere."""

    def __init__(self, stage: str) -> None:
        """Start the clock; nothing is shown within the first second."""
        self.stage = stage
        self.count = 0
        self.start = self.shown = time.monotonic()
        quiet = logging.getLogger(LOGGER).level >= logging.ERROR
        self.enabled = sys.stderr.isatty() and not quiet
        self.drawn = False

    def advance(self, items: int = 1) -> None:
        """Count items that are done."""
        check()
        self.count += items
        now = time.monotonic()
        if self.enabled and now - self.start > PATIENCE and now - self.shown > 0.1:
            self.shown, self.drawn = now, True
            rate = self.count / (now - self.start)
            text = f"facade {self.stage}: {self.count} done, {rate:.3g} a second"
            click.echo(f"\r{text}\x1b[K", nl=False, err=True)

    def close(self) -> None:
        """Remove the line."""
        if self.drawn:
            click.echo("\r\x1b[K", nl=False, err=True)
