"""What the commands say: errors and warnings of one line, in the words of the command line."""

from __future__ import annotations

import contextlib
import re
import sys
import warnings
from collections.abc import Iterator
from dataclasses import fields

from softvox_gym.files import OutputError
from softvox_gym.physics import Physics

PARAMETERS = tuple(f.name for f in fields(Physics))


class BadInputError(Exception):
    """What the user gave can't be used; the message is one line naming the mend."""


@contextlib.contextmanager
def bad_input(option: str = "") -> Iterator[None]:
    """Turn the errors that the package raises for bad arguments into `BadInputError`.

    Parameters
    ----------
    option : str
        Put before the message, where the package can't know the option's name.
    """
    try:
        yield
    except (ValueError, TypeError, OutputError) as error:
        raise BadInputError(f"{option} {error}" if option else in_options(str(error))) from error
    except OSError as error:
        if not option:
            raise
        raise BadInputError(f"{option} {error.filename}: {error.strerror}") from error


def in_options(message: str) -> str:
    """Name options in a message where the package names its arguments.

    Names that are also plain English (strain, density) count only as the first word.
    """
    message = message.replace("shape=(nx, ny, nz)", "--shape NX NY NZ")
    for name in (*PARAMETERS, "threads", "shape"):
        option = "--" + name.replace("_", "-")
        message = re.sub(rf"\b{name}\b" if "_" in name else rf"^{name}\b", option, message)
    return message


def complain(kind: str, message: str) -> None:
    """Say one line on standard error."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            print(f"softvox: {kind}: {' '.join(message.split())}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def one_line_warnings() -> Iterator[None]:
    """Show warnings like errors."""

    def show(message: Warning | str, *_: object, **__: object) -> None:
        complain("warning", in_options(str(message)))

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield
