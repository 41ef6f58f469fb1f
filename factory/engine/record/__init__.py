"""The record of a run: its states, figures and failures, and the verdict on it."""
