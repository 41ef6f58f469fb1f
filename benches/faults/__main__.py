"""`python -m benches.faults [--quick] [--go-on] [NAME ...]`: measure all sections, or some, and
write docs/faults.md."""

from __future__ import annotations

from benches.reporting import DOCS, Report

RUNS = ("campaigns", "deaths", "production")
"""The sections that are many runs, of which those that are kept need not be done again."""

REPORT = Report(
    "benches.faults",
    "# Faults\n\nWhat becomes of factories in which things go wrong, measured in MuJoCo. Written by"
    " `make faults` (`python -m benches.faults NAME` for one section) from what is kept in"
    " docs/faults/. The supervisor is told of no fault: it has what sensors measure, with their"
    " default noise.",
    (*RUNS, "sensors", "kills"),
    DOCS / "faults.md",
    ("mujoco", "numpy", "scipy"),
)


def main() -> None:
    """Measure, and write the report after each section."""
    parser = REPORT.parser(__doc__)
    parser.add_argument("--go-on", action="store_true", help="only runs that are not kept yet")
    given = parser.parse_args()
    for name in REPORT.chosen(parser, given):
        print(f"{name} ...", flush=True)
        REPORT.measure(name, given.quick, goes_on=given.go_on and name in RUNS)
        REPORT.write()


if __name__ == "__main__":
    main()
