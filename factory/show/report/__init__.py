"""A run as one page for people: an HTML file that opens from disk, with no network."""

from factory.show.report.page import page
from factory.show.report.recording import Recording, recording_of

__all__ = ["Recording", "page", "recording_of"]
