"""`python -m tests.bench.faults [--quick] [NAME ...]`: measure all sections, or some, and write
docs/faults.md."""

from __future__ import annotations

from tests.reporting import DOCS, Report

REPORT = Report(
    "tests.bench.faults",
    "# Faults\n\nWhat becomes of factories in which things go wrong, measured in MuJoCo. Written by"
    " `make faults` (`python -m tests.bench.faults NAME` for one section) from what is kept in"
    " docs/faults/. The supervisor is told of no fault: it has what sensors measure, with their"
    " default noise.",
    ("campaigns", "deaths", "takeovers", "production", "sensors", "kills"),
    DOCS / "faults.md",
    ("mujoco", "numpy", "scipy"),
)


def main() -> None:
    """Measure, and write the report after each section."""
    parser = REPORT.parser(__doc__)
    given = parser.parse_args()
    for name in REPORT.chosen(parser, given.names):
        print(f"{name} ...", flush=True)
        REPORT.measure(name, given.quick)
        REPORT.write()


if __name__ == "__main__":
    main()
