"""Runs shown to people: the report and the live page."""
