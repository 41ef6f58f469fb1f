"""TOML files, and where in them a key stands."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from factory.support.errors import Diagnostic, InputError, Position
from factory.support.files import TABLE, read_bytes

__all__ = ["key_position", "read_toml"]


def read_toml(path: Path, hint: str) -> tuple[str, dict[str, Any]]:
    """Text and content of a TOML file. Raises InputError, with the hint: BadFile if it cannot be
    read, Syntax if it is not TOML."""
    try:
        content = read_bytes(path, TABLE)
    except OSError as error:
        message = f"'{path}' cannot be read: {error.strerror}"
        raise InputError(Diagnostic("BadFile", message, None, hint)) from error
    try:
        text = content.decode("utf-8-sig")
        return text, tomllib.loads(text)
    except UnicodeDecodeError as error:
        words = f"byte 0x{content[error.start]:02x} is not UTF-8 text"
    except tomllib.TOMLDecodeError as error:
        raise InputError(_broken(path, text, str(error), hint)) from None
    except RecursionError:
        words = "the file is nested too deeply"
    except ValueError:
        words = "a number has too many digits"
    raise InputError(Diagnostic("Syntax", words, Position(str(path), 1, 1), hint))


def _broken(path: Path, text: str, words: str, hint: str) -> Diagnostic:
    """The error of tomllib, at its position."""
    match = re.search(r" \(at line (\d+), column (\d+)\)", words)
    if match is None:
        return Diagnostic("Syntax", words, Position(str(path), 1, 1), hint)
    line, column = int(match[1]), int(match[2])
    at = Position(str(path), line, column, text.splitlines()[line - 1])
    return Diagnostic("Syntax", words.replace(match[0], ""), at, hint)


def key_position(path: Path, text: str, key: str) -> Position:
    """Position of a key in TOML: its first occurrence at the start of a line or in a header."""
    for number, line in enumerate(text.splitlines(), 1):
        if match := re.match(rf"""\s*\[*\s*["']?({re.escape(key)})\b""", line):
            return Position(str(path), number, match.start(1) + 1, line)
    return Position(str(path), 1, 1)
