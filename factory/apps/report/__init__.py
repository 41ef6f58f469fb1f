"""A run as one page for people: an HTML file that opens from disk, with no network."""

from factory.apps.report.page import page
from factory.apps.report.recording import Recording, recording_of

__all__ = ["Recording", "page", "recording_of"]
