"""Runs of projects: logged, filmed, recovering, watched by a monitor, and judged."""
