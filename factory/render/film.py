"""Films and stills of a run as it goes on: observers of the run, which they don't disturb."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from factory.closing import Closing
from factory.render.camera import camera_named
from factory.render.camerawork import FPS, SIZE, Moment, Reel, Size, Take, When, pictureless, save
from factory.render.subject import Snapshot, held
from factory.render.video import check_output

if TYPE_CHECKING:
    from factory.simulation import Simulation


class _Observer(Closing):
    """What films and stills of a run have in common: an observer, and a context manager."""

    def __init__(self, simulation: Simulation, size: Size, camera: str, caption: bool) -> None:
        if simulation.model is None:
            raise pictureless()
        from factory.mjcf.model import product_name

        self.simulation = simulation
        product = product_name(simulation.layout.factory)
        world = simulation.world
        self.take = Take(world.m, product, simulation.units, size, camera_named(camera), caption)
        self.last = self._moment()

    def __call__(self, world: Any, supervisor: Any) -> None:
        self.observe(world, supervisor)

    def observe(self, world: Any, supervisor: Any) -> None:
        raise NotImplementedError

    def _moment(self) -> Moment:
        world = self.simulation.world
        made = world.delivered() - self.simulation.before
        return Moment(world.time, made, Snapshot.of(world.m, world.d))


class Film(_Observer):
    """Films a run: a frame whenever simulated time reaches the next, from the run itself.

    Frame k is at k / fps seconds, so T seconds have ⌊T fps⌋ + 1 frames. Closed after an
    interruption too, the file holds what happened until then. Raises InputError for a size, rate,
    ending or camera that will not do, MissingError where there is no GL."""

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        size: Size = SIZE,
        fps: float = FPS,
        camera: str = "overview",
        caption: bool = True,
    ) -> None:
        check_output(path, size, fps)
        super().__init__(simulation, size, camera, caption)
        self.reel = Reel(self.take, Path(path), fps)
        self.reel.until(self.last)

    @property
    def frames(self) -> int:
        """Frames taken."""
        return self.reel.frames

    def observe(self, world: Any, supervisor: Any) -> None:
        """Take the frames that are due."""
        self.reel.until(self._moment())

    def close(self) -> None:
        """Finish the file."""
        self.reel.close()


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
    ) -> None:
        check_output(path, size, still=True)
        super().__init__(simulation, size, camera, caption)
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
        save(self.take, self.last, self.path)


def still(
    simulation: Simulation,
    path: Path | str,
    size: Size = SIZE,
    camera: str = "overview",
    caption: bool = True,
) -> None:
    """A still of the state a simulation is in now."""
    Still(simulation, path, size, camera, "end", caption).close()
