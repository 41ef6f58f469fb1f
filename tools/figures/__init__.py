"""The figures of the theory pages, docs/theory/figures: each drawn from what the package computes.

`python -m tools.figures` draws them all; they are the same bytes each time.
"""
