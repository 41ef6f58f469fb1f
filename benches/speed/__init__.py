"""Times and sizes, and those of what a user would pick instead, measured side by side.

`python -m benches.speed [NAME ...]` measures them all, or some.

A section is a module with `measure(quick) -> dict` (as JSON takes it) and `section(results) -> str`
(Markdown); most have a `work`, which is one measurement, done in a process of its own. What each
measured is kept in docs/benchmarks/NAME.json, and docs/benchmarks.md is written from all that is
kept."""
