"""Pictures without a screen: films and stills of a run.

* From a run to a file: `film.py` (`Film.observe`) makes moments of states, `camerawork.py` pictures
  of moments, `reel.py` files of pictures (`support/pictures/`). `shot.py` does so for recorded
  states too.
* What is drawn: `dress.py` makes the drawn model, with `skins.py`, `outfits.py`, `housings.py` and
  `lettering.py`, and the surfaces and lights of `look.py`.
* Who draws: `painter.py`, or `filament.py` with `studio.py`.
* Where the camera stands: `following.py`, `tour.py`, `vantage.py`, `junction.py`, `hero.py`,
  `finale.py`; what is hidden from it or marked: `action.py`, `spotlight.py`, `marks.py`.
* The panels: `net_panel.py` and `gantt_panel.py`, both a `sheet.py`, of what `history.py` keeps,
  in the colours of `colours.py`; the caption is `caption.py`.
"""

from factory.film.film import Film, Still
from factory.film.picture import Picture, camera_named, panels_named
from factory.support.pictures.video import check_output

__all__ = [
    "Film",
    "Picture",
    "Still",
    "camera_named",
    "check_output",
    "panels_named",
]
