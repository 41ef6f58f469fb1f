"""Campaigns that measure how far the physics can be believed.

`python -m benches.fidelity [NAME ...]` runs them all, or some.

A section is a module with `measure(quick) -> dict` (as JSON takes it) and `section(results) -> str`
(Markdown). What each measured is kept in docs/fidelity/NAME.json, and docs/fidelity.md is written
from all that is kept."""
