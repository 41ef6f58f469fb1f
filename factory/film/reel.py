"""From moments to files: films frame by frame, stills, and the poster of a film."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as iio

from factory.film.camerawork import Camerawork, Moment, Take
from factory.film.ink import Pixels
from factory.film.video import VideoFile, check_output
from factory.support.files import unwritten, write_bytes
from factory.support.resource import Closing

SAMPLES = 24
"""Pictures that a still is the mean of."""


HOLD = 1.0
"""How long a film shows its last moment [s]."""


class Reel(Closing):
    """Frames of a growing row of moments, at even times, into a video file, and of the last one for
    HOLD; with a still of the best of them where there is to be a `poster`."""

    def __init__(self, take: Take, path: Path, fps: float, poster: Path | None = None) -> None:
        check_output(path, take.picture.size, fps)
        if poster is not None:
            check_output(poster, take.picture.size, still=True)
        self.fps, self.last = fps, None  # type: float, Moment | None
        self.poster = None if poster is None else Poster(take, poster)
        self.work = Camerawork(take)
        try:
            self.file = VideoFile(path, take.picture.size, fps)
        except BaseException:
            self.work.close()
            raise

    @property
    def frames(self) -> int:
        """Frames written."""
        return self.file.frames

    def until(self, now: Moment) -> None:
        """Write the frames due by now."""
        if self.poster is not None:
            self.poster.see(now)
        while self.frames / self.fps <= now.time + 1e-9:
            due = self.frames / self.fps
            moment = self.last.towards(now, due) if self.last is not None else now
            self.file.write(self.work.picture(moment, 1 / self.fps if self.frames else 0.0))
        self.last = now

    def close(self) -> None:
        """Finish the file, give the GL back and write the poster."""
        self.give_up()
        if self.poster is not None:
            self.poster.save()

    def give_up(self) -> None:
        """Finish the file and give the GL back."""
        try:
            with self.file:
                self._hold()
        finally:
            self.work.close()

    def _hold(self) -> None:
        """Write the frames of the last moment, in which the last unit is out."""
        if self.last is not None:
            pixels, self.last = self.work.picture(self.last, 1 / self.fps), None
            for _ in range(round(HOLD * self.fps)):
                self.file.write(pixels)


class Poster:
    """Chooses among the moments at which a product has just become whole, that is the last
    operation before the dropoff has ended: the one with the most parts in the factory, the latest
    of these; where there is none, the last moment. It is kept, and saved when the film is over."""

    def __init__(self, take: Take, path: Path) -> None:
        self.take, self.path = take, path
        self.moment: Moment | None = None
        factory, m = take.subject.factory, take.m
        self.ends = {factory.by_label[product].end for product in factory.products}
        self.seen, self.whole, self.most = 0, False, -1
        self.parked = {e for e in range(m.neq) if m.equality(e).name.startswith("park/")}

    def see(self, moment: Moment) -> None:
        """A moment of the film; the history is as far."""
        fired = self.take.history.events[self.seen :]
        self.seen += len(fired)
        if not self.ends.isdisjoint(fired):
            shown = len(self.parked.difference(moment.shown.active.tolist()))
            if shown >= self.most:
                self.most, self.moment = shown, moment
            self.whole = True
        elif not self.whole:
            self.moment = moment

    def save(self) -> None:
        """Write the poster."""
        if self.moment is not None:
            save(self.take, self.moment, self.path)


def save(take: Take, moment: Moment, path: Path) -> None:
    """A still of a moment as PNG."""
    with Camerawork(take, SAMPLES) as work:
        pixels = work.picture(moment)
    write_still(path, pixels)


def write_still(path: Path, pixels: Pixels) -> None:
    """A picture (height, width, 3) as PNG. Raises InputError where it cannot be written."""
    content = iio.imwrite("<bytes>", pixels, extension=".png", plugin="pillow")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
    except OSError as error:
        raise unwritten(path, error) from error
