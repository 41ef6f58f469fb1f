"""Films and stills of a run, by observers that do not disturb it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from factory.engine.mjcf.model import Model
from factory.engine.record.state import Recorder, State
from factory.engine.record.subject import MonitorSubject
from factory.film.action import Snapshot, held
from factory.film.camerawork import Camerawork, Moment, Take, When, past_the_end, pictureless
from factory.film.history import TIE, History
from factory.film.picture import USUAL, Picture
from factory.film.reel import Reel, save
from factory.support.pictures.ink import Pixels
from factory.support.pictures.video import FPS, check_output
from factory.theory.nets.undone import Undone

if TYPE_CHECKING:
    from factory.engine.simulation.simulation import Simulation


class _Observer(Recorder):
    """Base class of films and stills of a run."""

    def __init__(self, simulation: Simulation, picture: Picture) -> None:
        if simulation.model is None:
            raise pictureless()
        factory = simulation.layout.factory
        picture.check(factory.pag)
        subject = MonitorSubject.of_run(simulation)
        m, made, self.history = simulation.physical.m, simulation.model, History(subject)
        name, units = Model.product_name(factory), simulation.request.units
        self.take = Take(m, made.xml, made.files, subject, name, units, picture, self.history)
        self.last = self._moment(simulation.state())

    def _moment(self, state: State) -> Moment:
        history, account = self.history, state.account
        for event in state.events[history.taken :]:
            history.add(event.t, event if isinstance(event, Undone) else event.transition)
        if account is not None:
            history.failings += account.found[len(history.failings) :]
            history.stand(account.stood)
        seen = state.observation
        return Moment(state.time, state.made, Snapshot.of(seen.qpos.copy(), seen.welds))


class Film(_Observer):
    """Films a run: a frame whenever simulated time reaches the next, from the run itself.

    Frame k is at k / fps seconds, so T seconds have ⌊T fps⌋ + 1 frames, and those of the last
    moment (`reel.HOLD`). Closed after an interruption too, the file holds what happened until then.
    `poster`: a still (PNG) of the moment that shows most. Raises InputError for a size, rate,
    ending or camera that will not do, MissingError where there is no GL."""

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        picture: Picture = USUAL,
        fps: float = FPS,
        poster: Path | str | None = None,
    ) -> None:
        super().__init__(simulation, picture)
        self.figures = simulation.figures
        self.reel = Reel(self.take, Path(path), fps, None if poster is None else Path(poster))
        try:
            self.reel.until(self.last)
        except BaseException:  # no file is left without a frame
            self.reel.give_up()
            raise

    @property
    def frames(self) -> int:
        """Frames taken."""
        return self.reel.frames

    def observe(self, state: State) -> None:
        """Take the frames that are due."""
        self.reel.until(self._moment(state))

    def close(self) -> None:
        """Finish the file, and write the poster."""
        self._count()
        self.reel.close()

    def _count(self) -> None:
        figures = self.figures()
        self.reel.contacts = figures.unintended_contacts if figures else None

    def __exit__(self, *raised: object) -> None:
        self._count()
        self.reel.__exit__(*raised)


class Still(_Observer):
    """A still (PNG) of a run at a time [s], or at its end; written when it is closed, except after
    an exception before that time.

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

    def observe(self, state: State) -> None:
        """Keep the state if the picture may be of it."""
        if self.at != "end" and self._has_come:
            return
        now = self._moment(state)
        holds = held(self.take.m, now.shown)
        follows = self.take.picture.camera == "product"
        if self.at != "end" or not follows or holds or not self.held:
            self.last, self.held = now, self.held or holds

    @property
    def _has_come(self) -> bool:
        """Whether the time of the picture has come."""
        return self.at == "end" or self.last.time >= self.at - TIE

    def close(self) -> None:
        """Take the picture. Raises InputError (BadValue) where the run ended before its time."""
        if self.at != "end" and not self._has_come:
            raise past_the_end(self.at, "run", self.last.time)
        save(self.take, self.last, self.path)

    def __exit__(self, *raised: object) -> None:
        if self._has_come or raised[0] is None:
            self.close()


class Glimpses(_Observer):
    """Pictures of a run as it is when one is asked for. Raises InputError in the ideal world,
    MissingError where there is no GL."""

    def __init__(self, simulation: Simulation, picture: Picture = USUAL) -> None:
        super().__init__(simulation, picture)
        self._run, self._camera = simulation, Camerawork(self.take)

    def draw(self) -> Pixels:
        """A picture (height, width, 3)."""
        return self._camera.picture(self._moment(self._run.state()))

    def observe(self, state: State) -> None:
        """Nothing: no picture is asked for."""

    def close(self) -> None:
        """Give the GL context back."""
        self._camera.close()
