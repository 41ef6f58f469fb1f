"""Drawings and pages that other apps make: SVG (`canvas.py`), its paper
(`tables.py`), and text in XML (`markup.py`)."""
