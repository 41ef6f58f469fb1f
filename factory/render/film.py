"""Films and stills of a run as it goes on: observers of the run, which they don't disturb."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from factory.record.monitor.subject import subject_of_run
from factory.render.area import PanelName, shared
from factory.render.camera import camera_named
from factory.render.camerawork import FPS, SIZE, Moment, Reel, Size, Take, When, pictureless, save
from factory.render.history import History
from factory.render.poster import Poster
from factory.render.subject import Snapshot, held
from factory.render.video import check_output
from factory.support.resource import Closing

if TYPE_CHECKING:
    from factory.simulation.simulation import Simulation


class _Observer(Closing):
    """What films and stills of a run have in common: an observer, and a context manager."""

    def __init__(
        self,
        simulation: Simulation,
        size: Size,
        camera: str,
        caption: bool,
        panels: tuple[PanelName, ...],
        title: str,
    ) -> None:
        if simulation.model is None:
            raise pictureless()
        from factory.mjcf.model import product_name

        self.simulation, factory = simulation, simulation.layout.factory
        camera = camera_named(camera, [part.label for part in factory.leaves])
        shared(size, panels)
        subject = subject_of_run(simulation)
        product, m = product_name(factory), simulation.physical.m
        self.take = Take(
            m, product, simulation.units, size, camera, caption, subject, panels, title
        )
        self.history = History(subject)
        self.number = factory.net.threaded.net.transition_index
        self.last = self._moment()

    def __call__(self, world: Any, supervisor: Any) -> None:
        self.observe(world, supervisor)

    def observe(self, world: Any, supervisor: Any) -> None:
        raise NotImplementedError

    def _moment(self) -> Moment:
        world, events = self.simulation.physical, self.simulation.supervisor.events
        for event in events[len(self.history.events) :]:
            self.history.fire(event.t, self.number[event.transition])
        made = world.delivered() - self.simulation.before
        return Moment(world.time, made, Snapshot.of(world.m, world.d))


class Film(_Observer):
    """Films a run: a frame whenever simulated time reaches the next, from the run itself.

    Frame k is at k / fps seconds, so T seconds have ⌊T fps⌋ + 1 frames. Closed after an
    interruption too, the file holds what happened until then. `panels` are beside the 3-D; `title`
    is shown at the beginning; `poster`: a still (PNG) of the moment that shows most. Raises
    InputError for a size, rate, ending or camera that will not do, MissingError where there is no
    GL."""

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        size: Size = SIZE,
        fps: float = FPS,
        camera: str = "overview",
        caption: bool = True,
        panels: tuple[PanelName, ...] = (),
        title: str = "",
        poster: Path | str | None = None,
    ) -> None:
        check_output(path, size, fps)
        super().__init__(simulation, size, camera, caption, panels, title)
        self.poster = None
        if poster is not None:
            check_output(poster, size, still=True)
            self.poster = Poster(self.take, self.history, Path(poster))
            self.poster.see(self.last)
        self.reel = Reel(self.take, Path(path), fps, self.history)
        self.reel.until(self.last)

    @property
    def frames(self) -> int:
        """Frames taken."""
        return self.reel.frames

    def observe(self, world: Any, supervisor: Any) -> None:
        """Take the frames that are due."""
        now = self._moment()
        if self.poster is not None:
            self.poster.see(now)
        self.reel.until(now)

    def close(self) -> None:
        """Finish the file, and write the poster."""
        self.reel.close()
        if self.poster is not None:
            self.poster.save()


class Still(_Observer):
    """A still (PNG) of a run at a time [s], or at its end; written when it is closed.

    For the camera `product` the end is when the output robot last holds a product.
    """

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        size: Size = SIZE,
        camera: str = "overview",
        at: When = "end",
        caption: bool = True,
        panels: tuple[PanelName, ...] = (),
        title: str = "",
    ) -> None:
        check_output(path, size, still=True)
        super().__init__(simulation, size, camera, caption, panels, title)
        self.path, self.at, self.held = Path(path), at, False

    def observe(self, world: Any, supervisor: Any) -> None:
        """Keep the state if it may be the one."""
        if self.at != "end" and self.last.time >= self.at:
            return
        now = self._moment()
        if self.at != "end" or not self.take.best or held(world.m, now.shown) or not self.held:
            self.last, self.held = now, self.held or held(world.m, now.shown)

    def close(self) -> None:
        """Take the picture."""
        save(self.take, self.last, self.path, self.history)


def still(
    simulation: Simulation,
    path: Path | str,
    size: Size = SIZE,
    camera: str = "overview",
    caption: bool = True,
) -> None:
    """A still of the state a simulation is in now."""
    Still(simulation, path, size, camera, "end", caption).close()
