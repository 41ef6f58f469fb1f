"""Pictures without a screen: films and stills of a run."""

from factory.film.film import Film, Still
from factory.film.picture import Picture, camera_named, panels_named
from factory.film.video import check_output

__all__ = [
    "Film",
    "Picture",
    "Still",
    "camera_named",
    "check_output",
    "panels_named",
]
