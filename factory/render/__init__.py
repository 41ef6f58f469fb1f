"""Pictures without a screen: films and stills of a run, or of its log."""

from factory.render.camera import CAMERAS, Camera, camera_named
from factory.render.camerawork import FPS, SIZE
from factory.render.film import Film, Still, still
from factory.render.replay import render_log
from factory.render.video import FILMS, STILLS, check_output

__all__ = [
    "CAMERAS",
    "FILMS",
    "FPS",
    "SIZE",
    "STILLS",
    "Camera",
    "Film",
    "Still",
    "camera_named",
    "check_output",
    "render_log",
    "still",
]
