"""From moments to files: films frame by frame, stills, and the poster of a film."""

from __future__ import annotations

from pathlib import Path

from factory.film.camerawork import Camerawork, Moment, Take
from factory.film.finale import finale
from factory.support.pictures.still import write_still
from factory.support.pictures.video import VideoFile, check_output
from factory.support.resource import Closing

SAMPLES = 24
"""Pictures that a still is the mean of."""


HOLD = 1.0
"""How long a film shows its last moment [s]."""


class Reel(Closing):
    """Frames of a growing row of moments, at even times, into a video file, of the last one for
    HOLD, and of a product that was finished (`finale.py`); with a still of the best moment where
    there is to be a `poster`. `contacts`: number of unintended contacts of the run, None where
    unknown."""

    def __init__(self, take: Take, path: Path, fps: float, poster: Path | None = None) -> None:
        check_output(path, take.picture.size, fps)
        if poster is not None:
            check_output(poster, take.picture.size, still=True)
        self.fps, self.last = fps, None  # type: float, Moment | None
        self.poster = None if poster is None else Poster(take, poster)
        self.take = take
        self.whole: Moment | None = None
        self.contacts: int | None = None
        self.products = Completions(take)
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
        completed = self.products.since_last()
        if completed:
            self.whole = now
        if self.poster is not None:
            self.poster.see(now, completed)
        while self.frames / self.fps <= now.time + 1e-9:
            due = self.frames / self.fps
            moment = self.last.towards(now, due) if self.last is not None else now
            self.file.write(self.work.picture(moment, 1 / self.fps if self.frames else 0.0))
        self.last = now

    def close(self) -> None:
        """Finish the file with the product, give the GL back and write the poster."""
        with self.file:
            try:
                self._hold()
            finally:
                self.work.close()
            if self.whole is not None and self.last is not None:
                for pixels in finale(self.take, self.whole, self.last, self.fps, self.contacts):
                    self.file.write(pixels)
        if self.poster is not None:
            self.poster.save()

    def __exit__(self, *raised: object) -> None:
        if raised[0] is not None:  # an interruption does not wait for more pictures
            self.whole = None
        self.close()

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
            pixels = self.work.picture(self.last, 1 / self.fps)
            for _ in range(round(HOLD * self.fps)):
                self.file.write(pixels)


class Completions:
    """Says when products become whole: the last operation before the dropoff has ended."""

    def __init__(self, take: Take) -> None:
        factory, self.history, self.seen = take.subject.factory, take.history, 0
        self.ends = {factory.by_label[product].end for product in factory.products}

    def since_last(self) -> bool:
        """Whether one has become whole since it was asked last."""
        fired = self.history.events[self.seen :]
        self.seen += len(fired)
        return not self.ends.isdisjoint(fired)


class Poster:
    """Chooses among the moments at which a product has just become whole, that is the last
    operation before the dropoff has ended: the one with the most parts in the factory, the latest
    of these; where there is none, the last moment. It is kept, and saved when the film is over."""

    def __init__(self, take: Take, path: Path) -> None:
        self.take, self.path = take, path
        self.moment: Moment | None = None
        self.whole, self.most, m = False, -1, take.m
        self.parked = {e for e in range(m.neq) if m.equality(e).name.startswith("park/")}

    def see(self, moment: Moment, completed: bool) -> None:
        """A moment of the film, at which a product was `completed` or not."""
        if completed:
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
