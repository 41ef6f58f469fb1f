"""Drawings and pages that other apps make: SVG and its paper."""
