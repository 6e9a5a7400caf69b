"""Errors and warnings of one line, in terms of the command line's options."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Iterator

from softvox_gym.files import OutputError
from softvox_gym.physics import ParameterError


class BadInputError(Exception):
    """The user's input can't be used; the message is one line that names the remedy."""


@contextlib.contextmanager
def bad_input(option: str = "") -> Iterator[None]:
    """Turn the errors that the package raises for bad arguments into `BadInputError`.

    The option is put before the message, because the package can't know its name.
    """
    try:
        yield
    except ParameterError as error:
        name = error.parameter.replace("_", "-")
        raise BadInputError(f"--{name} {error.reason}") from error
    except (ValueError, TypeError, OutputError) as error:
        raise BadInputError(f"{option} {error}".strip()) from error
    except OSError as error:
        if not option:
            raise
        raise BadInputError(f"{option} {error.filename}: {error.strerror}") from error


def degrade_output() -> None:
    """Make the standard streams write an escape for characters that their encoding lacks."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)  # a captured stream may have none
        if reconfigure:
            reconfigure(errors="backslashreplace")


def complain(kind: str, message: str) -> None:
    """Print one line on standard error."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            print(f"softvox: {kind}: {' '.join(message.split())}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def one_line_warnings() -> Iterator[None]:
    """Show warnings like errors."""

    def show(message: Warning | str, *_: object, **__: object) -> None:
        complain("warning", str(message))

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield
