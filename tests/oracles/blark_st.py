"""Parses Structured Text with blark: the kind and name of each thing declared."""

import json
import sys
from pathlib import Path


def main() -> None:
    import blark.parse

    parsed = blark.parse.parse_source_code(Path(sys.argv[1]).read_text("utf-8"))
    if parsed.exception is not None:
        raise parsed.exception
    items = parsed.transform().items
    print(json.dumps([[type(item).__name__, str(getattr(item, "name", ""))] for item in items]))


if __name__ == "__main__":
    main()
