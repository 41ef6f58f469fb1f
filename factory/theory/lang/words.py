"""Labels, the words of the languages."""

from __future__ import annotations

import re

LABEL_HINT = "a label has letters, digits, '_', '-' and '.'"

_LABEL = re.compile(r"[^\s+;,()=<>{}~\"/]+")


def is_label(word: str) -> bool:
    """Whether a word of the lexer may be a label."""
    return _LABEL.fullmatch(word) is not None
