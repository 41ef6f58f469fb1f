"""The floor that robots sweep: which of them could touch what lies there."""

from __future__ import annotations

APART = 0.02
"""Robots keep so far from what lies about [m]."""
