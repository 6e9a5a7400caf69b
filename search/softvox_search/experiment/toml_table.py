"""Reading a TOML file strictly: every key known, present and of its type, or one line says why."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable
from math import isfinite
from pathlib import Path
from typing import Any


class ConfigError(Exception):
    """What a file describes is no experiment; one line names the file, the key and the mend."""


#: In place of a default, where a key must be there.
REQUIRED: Any = object()

#: Whole numbers above it are mistakes.
MOST = 2**31 - 1


def load(path: Path) -> Table:
    """Read a TOML file.

    Raises
    ------
    ConfigError
        Where it can't be read or is no TOML.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not text in UTF-8, as TOML must be") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: is not valid TOML: {error}") from None
    except ValueError as error:  # a number with more digits than Python reads
        raise ConfigError(f"{path}: can't be read: {error}") from None
    return Table(data, str(path))


class Table:
    """A table of the file; its keys are taken one by one, and `close` refuses what is left.

    Parameters
    ----------
    data : dict
        As `tomllib` reads it.
    path : str
        Of the file, for errors.
    place : str
        Which table of the file this is, for errors; "" for the outermost.
    """

    def __init__(self, data: dict[str, Any], path: str, place: str = "") -> None:
        self._left = dict(data)
        self._known: list[str] = []
        self._path = path
        self.place = place

    def __contains__(self, key: str) -> bool:
        return key in self._left

    def error(self, message: str) -> ConfigError:
        """Return an error about this table."""
        place = f"{self.place} " if self.place else ""
        return ConfigError(f"{self._path}: {place}{message}")

    def take(self, key: str, default: Any, expected: str = "a value") -> Any:
        """Take whatever is at a key."""
        self._known.append(key)
        if key in self._left:
            return self._left.pop(key)
        if default is REQUIRED:
            close = difflib.get_close_matches(key, self._left, n=1)
            hint = f"; is {close[0]} meant to be it?" if close else ""
            raise self.error(f"lacks the key {key}, {expected}{hint}")
        return default

    def whole(self, key: str, default: Any = REQUIRED, *, least: int = 1, most: int = MOST) -> Any:
        """Take a whole number of at least and at most so much."""
        expected = f"a whole number of at least {least}"
        value = self.take(key, default, expected)
        if value is default:
            return value
        if type(value) is not int or value < least:
            raise self.error(f"{key} must be {expected}, got {value!r}")
        if value > most:
            size = value if value.bit_length() <= 128 else f"one of {value.bit_length()} bits"
            raise self.error(f"{key} must be {expected} and at most {most}, got {size}")
        return value

    def flag(self, key: str, default: Any = REQUIRED) -> Any:
        """Take true or false."""
        value = self.take(key, default, "true or false")
        if value is not default and not isinstance(value, bool):
            raise self.error(f"{key} must be true or false, got {value!r}")
        return value

    def text(self, key: str, default: Any = REQUIRED, *, choices: Iterable[str] = ()) -> Any:
        """Take a text, of these choices where there are any."""
        choices = tuple(choices)
        expected = f"one of {', '.join(choices)}" if choices else "a text that is not empty"
        value = self.take(key, default, expected)
        if value is default:
            return value
        if not isinstance(value, str) or not value:
            raise self.error(f"{key} must be {expected}, got {value!r}")
        if choices and value not in choices:
            raise self.error(f"{key} must be {expected}, got {value!r}{meant(value, choices)}")
        return value

    def levels(self, key: str) -> Any:
        """Take a list of different numbers that are not negative; None where it is absent."""
        value = self.take(key, None)
        if value is None:
            return None
        if not isinstance(value, list) or not value or not all(map(_is_level, value)):
            raise self.error(
                f"{key} must be a list of numbers that are not negative, got {value!r}"
            )
        if len(set(value)) < len(value):
            raise self.error(f"{key} must be different numbers, got {value!r}")
        return tuple(map(float, value))

    def table(self, key: str, default: Any = REQUIRED) -> Table:
        """Take a table."""
        value = self.take(key, default, f"a table [{key}]")
        if not isinstance(value, dict):
            raise self.error(f"{key} must be a table, got {value!r}")
        return Table(value, self._path, f"{self.place}.{key}" if self.place else f"[{key}]")

    def tables(self, key: str, default: Any = REQUIRED) -> list[Table]:
        """Take tables [[key]]; their names say in errors which one is meant."""
        value = self.take(key, default, f"one table [[{key}]] or more")
        if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
            raise self.error(f"{key} must be tables [[{key}]], got {value!r}")
        return [
            Table(row, self._path, f"[[{key}]] {_name(row, number)}")
            for number, row in enumerate(value, start=1)
        ]

    def rest(self) -> dict[str, Any]:
        """Take all keys that are left."""
        rest, self._left = self._left, {}
        return rest

    def close(self) -> None:
        """Refuse keys that nobody took."""
        for key in self._left:
            raise self.error(unknown(key, self._known))


def unknown(key: str, known: Iterable[str]) -> str:
    """Return what to say of a key that is none of those known."""
    known = list(known)
    hint = meant(key, known)
    return f"has no key {key}{hint}{' Its' if hint else '; its'} keys are {', '.join(known)}"


def meant(given: str, valid: Iterable[str]) -> str:
    """Return a guess at what was meant, to be put behind an error, or nothing."""
    close = difflib.get_close_matches(given, list(valid), n=1)
    return f"; did you mean {close[0]}?" if close else ""


def _is_level(value: Any) -> bool:
    return type(value) in (int, float) and isfinite(value) and value >= 0


def _name(row: dict[str, Any], number: int) -> str:
    name = row.get("label", row.get("name"))
    return f"no. {number} ({name})" if isinstance(name, str) else f"no. {number}"
