"""Style and output of all plots. They need matplotlib, an optional package."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from factory.support.extras import optional

BLUE, ORANGE, RED, GREY, PALE = "#2f5d9b", "#e08a1e", "#c0392b", "#8a9099", "#e3e6ea"

STYLE: dict[str, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": PALE,
    "axes.axisbelow": True,
    "legend.frameon": False,
}


def require_matplotlib(what: str, otherwise: str) -> None:
    """Raises MissingError if matplotlib, which `what` needs, is not installed; `otherwise`: an
    alternative."""
    optional("matplotlib.figure", "matplotlib", what, "plots", otherwise)


def figure_and_axes(columns: int = 1, height: float = 3.4, rows: int = 1) -> tuple[Any, Any]:
    """A figure of usual width, and its axes (rows, columns)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def png(figure: Any) -> bytes:
    """A figure as PNG, the same bytes each time."""
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=130, metadata={"Software": None})
    return stream.getvalue()
