"""`python -m benches.compare [--quick] [NAME ...]`: measure all sections, or some, and write
docs/comparison.md."""

from __future__ import annotations

from benches.reporting import DOCS, Report

REPORT = Report(
    "benches.compare",
    "# Comparison\n\nWritten by `make compare` (`python -m benches.compare NAME` for one section)"
    " from what is kept in docs/comparison/. Published figures are cited; they were measured by"
    " others, on other machines, of other robots, and are not repeated here. Data of others is not"
    " part of this project: `FACTORY_LDRAW` and `FACTORY_IKEA` name folders with it, and what is"
    " not there is said to be missing.",
    ("bricks", "concurrency", "ablations", "manuals", "blocks", "deadlocks"),
    DOCS / "comparison.md",
    ("mujoco", "numpy", "scipy", "lark", "shapely"),
)


def main() -> None:
    """Measure, and write the report after each section."""
    parser = REPORT.parser(__doc__)
    for name in REPORT.chosen(parser, parser.parse_args()):
        print(f"{name} ", end="", flush=True)
        REPORT.measure(name, parser.parse_args().quick)
        REPORT.write()


if __name__ == "__main__":
    main()
