"""Pictures without a screen: films and stills of a run, or of its log."""

from factory.render.camera import CAMERAS, Camera, camera_named
from factory.render.film import Film, Still, render_log
from factory.render.picture import PANELS, PanelName, Picture, panels_named
from factory.render.video import FILMS, FPS, STILLS, check_output

__all__ = [
    "CAMERAS",
    "FILMS",
    "FPS",
    "PANELS",
    "STILLS",
    "Camera",
    "Film",
    "PanelName",
    "Picture",
    "Still",
    "camera_named",
    "check_output",
    "panels_named",
    "render_log",
]
