"""Reads an MCAP with Rerun's own importer: the rows it makes of each topic, by component."""

import json
import subprocess
import sys
from pathlib import Path


def main() -> None:
    import rerun as rr

    source, made = Path(sys.argv[1]), Path(sys.argv[2])
    rerun = Path(sys.executable).with_name("rerun")
    subprocess.run([rerun, "mcap", "convert", source, "-o", made], check=True, capture_output=True)
    shown = subprocess.run(
        [rerun, "rrd", "print", made], check=True, capture_output=True, text=True
    )
    print(json.dumps({"version": rr.__version__, "chunks": shown.stdout.splitlines()}))


if __name__ == "__main__":
    main()
