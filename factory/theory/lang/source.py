"""The text of a file that is read as a PAG, a template or a tree."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from factory.support.errors import Diagnostic, InputError, Position, usage_error
from factory.support.files import LOG, TEXT, head_of, read_bytes
from factory.support.texts import near_file, quoted, source_of

STDIN = "-"
"""The name that stands for stdin."""


def read_text(path: str | os.PathLike[str], most: int = TEXT) -> str:
    """The text of a UTF-8 file.

    Args:
        path: the file; `-` for stdin.
        most: upper bound on its size [bytes].

    Raises InputError: BadFile, Syntax where it is not UTF-8, Usage for a log.
    """
    name = os.fspath(path)
    try:
        data = head_of(Path(name), len(LOG))
        if data != LOG:
            data = read_bytes(Path("/dev/stdin" if name == STDIN else name), most)
        if not data.startswith(LOG):
            return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(_not_utf8(name, data, error.start)) from None
    except (OSError, ValueError) as error:
        raise InputError(_unreadable(name, error)) from None
    message = f"{quoted(name)} is a log of a run, not the PAG of a product"
    hint = "logs are for `monitor`, `report`, `render`, `export` and `analyze --measured`"
    raise usage_error(message, hint)


def _unreadable(name: str, error: Exception) -> Diagnostic:
    why = getattr(error, "strerror", None) or str(error)
    message = f"{quoted(name)} cannot be read: {why}"
    hint = "give a file that exists and that you may read"
    if isinstance(error, FileNotFoundError):
        message, hint = f"there is no file {quoted(name)}", near_file("", name) or hint
        if os.path.isfile(f"{name}.pag"):
            hint = f"did you mean {quoted(f'{name}.pag')}?"
    elif isinstance(error, IsADirectoryError):
        message, hint = f"{quoted(name)} is a folder, not a file", "name a file in it"
    elif name == STDIN:
        message, hint = f"nothing comes in: {why}", "for example: cat FILE.pag | factory check -"
    elif getattr(error, "errno", None) == errno.EFBIG:
        hint = "take it apart, or check that it is the file that is meant"
    return Diagnostic("BadFile", message, Position(name, 1, 1), hint)


def _not_utf8(name: str, data: bytes, offset: int) -> Diagnostic:
    before = source_of(data[:offset].decode("utf-8"), name).lines
    line, column = len(before), len(before[-1]) + 1
    shown = source_of(data.decode("utf-8", "replace"), name).lines[line - 1]
    binary = any(c < " " and c != "\t" for c in shown)
    at = Position(name, line, column, "" if binary else shown)
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    hint = "this is UTF-16: save the file as UTF-8" if wide else "save the file as UTF-8"
    return Diagnostic("Syntax", f"byte 0x{data[offset]:02x} is not UTF-8 text", at, hint)
