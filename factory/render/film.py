"""Films and stills of a run as it goes on: observers of the run, which they don't disturb."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from factory.mjcf.model import product_name
from factory.record.monitor.subject import subject_of_run
from factory.render.camerawork import Moment, Take, When, pictureless
from factory.render.history import History
from factory.render.picture import USUAL, Picture
from factory.render.reel import Reel, save
from factory.render.subject import Snapshot, held
from factory.render.video import FPS, check_output
from factory.support.resource import Closing

if TYPE_CHECKING:
    from factory.simulation.simulation import Simulation


class _Observer(Closing):
    """What films and stills of a run have in common: an observer, and a context manager."""

    def __init__(self, simulation: Simulation, picture: Picture) -> None:
        if simulation.model is None:
            raise pictureless()
        self.simulation, factory = simulation, simulation.layout.factory
        picture.check([part.label for part in factory.leaves])
        subject = subject_of_run(simulation)
        m, self.history = simulation.physical.m, History(subject)
        name, units = product_name(factory), simulation.request.units
        self.take = Take(m, subject, name, units, picture, self.history)
        self.number = factory.net.threaded.net.transition_index
        self.last = self._moment()

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
    interruption too, the file holds what happened until then. `poster`: a still (PNG) of the moment
    that shows most. Raises InputError for a size, rate, ending or camera that will not do,
    MissingError where there is no GL."""

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        picture: Picture = USUAL,
        fps: float = FPS,
        poster: Path | str | None = None,
    ) -> None:
        super().__init__(simulation, picture)
        self.reel = Reel(self.take, Path(path), fps, None if poster is None else Path(poster))
        self.reel.until(self.last)

    @property
    def frames(self) -> int:
        """Frames taken."""
        return self.reel.frames

    def observe(self, world: Any, supervisor: Any) -> None:
        """Take the frames that are due."""
        self.reel.until(self._moment())

    def close(self) -> None:
        """Finish the file, and write the poster."""
        self.reel.close()


class Still(_Observer):
    """A still (PNG) of a run at a time [s], or at its end; written when it is closed.

    For the camera `product` the end is when the output robot last holds a product.
    """

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        picture: Picture = USUAL,
        at: When = "end",
    ) -> None:
        check_output(path, picture.size, still=True)
        super().__init__(simulation, picture)
        self.path, self.at, self.held = Path(path), at, False

    def observe(self, world: Any, supervisor: Any) -> None:
        """Keep the state if it may be the one."""
        if self.at != "end" and self.last.time >= self.at:
            return
        now = self._moment()
        holds = held(world.m, now.shown)
        follows = self.take.picture.camera == "product"
        if self.at != "end" or not follows or holds or not self.held:
            self.last, self.held = now, self.held or holds

    def close(self) -> None:
        """Take the picture."""
        save(self.take, self.last, self.path)
