"""Exceptions with kind, place and help."""

from __future__ import annotations

import json
from typing import Any


class Error(Exception):
    """Work that failed.

    `kind` is one of the names that `--json` prints ("missing-file", "unsuitable-data", …), `help` says what to do, and
    `causes` are the errors behind this one, nearest first.
    """

    def __init__(self, message: str, kind: str = "", help: str | None = None, causes: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.message = message
        self.kind = kind
        self.help = help
        self.causes = causes

    def __str__(self) -> str:
        return self.message if not self.help else f"{self.message}\n  help: {self.help}"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.kind, self.help, self.causes)

    def renamed(self, name: str, shown: str) -> Error:
        """The same with another name for what it is about."""

        def of(part: Any) -> Any:
            if isinstance(part, tuple):
                return tuple(map(of, part))
            return part.replace(name, shown) if isinstance(part, str) else part

        made, parts = self.__reduce__()
        error: Error = made(*of(parts))
        return error


class DataError(Error):
    """The data cannot be read or used, or a file cannot be written."""


class CommandError(Error, ValueError):
    """An argument of a call cannot be."""


class ConfigurationError(Error, ValueError):
    """The configuration is wrong: at `line` and `column` (from 1) of `file`, or of an override of `set`."""

    def __init__(
        self,
        message: str,
        kind: str = "configuration",
        help: str | None = None,
        causes: tuple[str, ...] = (),
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        super().__init__(message, kind, help, causes)
        self.file = file
        self.line = line
        self.column = column

    def __str__(self) -> str:
        place = "" if self.line is None else f"{self.file}:{self.line}:{self.column}: "
        return place + super().__str__()

    def __reduce__(self) -> tuple[Any, ...]:
        place = (self.file, self.line, self.column)
        return type(self), (self.message, self.kind, self.help, self.causes, *place)


def from_document(text: str) -> Error:
    """The exception of an error as `--json` prints it."""
    found: dict[str, Any] = json.loads(text)
    message, kind, help = found["message"], found["kind"], found.get("help")
    causes = tuple(found.get("causes") or ())
    if kind == "command-line":
        return CommandError(message, kind, help, causes)
    if kind == "configuration":
        place = (found.get("file"), found.get("line"), found.get("column"))
        return ConfigurationError(message, kind, help, causes, *place)
    return DataError(message, kind, help, causes)
