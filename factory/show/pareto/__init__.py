"""A front as one page for people: an HTML file that opens from disk, with no network."""

from factory.show.pareto.page import floor_plans, front_page

__all__ = ["floor_plans", "front_page"]
