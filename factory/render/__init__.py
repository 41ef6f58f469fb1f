"""Pictures without a screen: films and stills of a run, or of its log."""

from factory.render.area import PANELS, PanelName, panels_named
from factory.render.camera import CAMERAS, Camera, camera_named
from factory.render.camerawork import FPS, SIZE
from factory.render.film import Film, Still, still
from factory.render.replay import render_log
from factory.render.video import FILMS, STILLS, check_output

__all__ = [
    "CAMERAS",
    "FILMS",
    "FPS",
    "PANELS",
    "SIZE",
    "STILLS",
    "Camera",
    "Film",
    "PanelName",
    "Still",
    "camera_named",
    "check_output",
    "panels_named",
    "render_log",
    "still",
]
