"""`python -m benches.fidelity [--quick] [NAME ...]`: measure all sections, or some, and write
docs/fidelity.md."""

from __future__ import annotations

from benches.reporting import DOCS, Report

REPORT = Report(
    "benches.fidelity",
    "# Fidelity\n\nHow far the physics can be believed, measured. Written by `make fidelity`"
    " (`python -m benches.fidelity NAME` for one section) from what is kept in docs/fidelity/.",
    (
        "seeds",
        "approaches",
        "convergence",
        "disturbances",
        "attraction",
        "planted",
        "long_runs",
    ),
    DOCS / "fidelity.md",
    ("mujoco", "numpy", "scipy"),
)


def main() -> None:
    """Measure, and write the report after each section."""
    parser = REPORT.parser(__doc__)
    parser.add_argument(
        "--only", nargs="+", default=(), metavar="PRODUCT", help="of `seeds`: renew these products"
    )
    given = parser.parse_args()
    if given.only and given.names != ["seeds"]:
        parser.error("--only goes with `seeds`")
    for name in REPORT.chosen(parser, given):
        print(f"{name} ...", flush=True)
        REPORT.measure(name, given.quick, given.only)
        REPORT.write()


if __name__ == "__main__":
    main()
