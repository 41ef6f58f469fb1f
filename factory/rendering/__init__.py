"""Pictures without a screen: films and stills of a run."""

from factory.rendering.film import Film, Still
from factory.rendering.picture import Picture, camera_named, panels_named
from factory.rendering.video import check_output

__all__ = [
    "Film",
    "Picture",
    "Still",
    "camera_named",
    "check_output",
    "panels_named",
]
