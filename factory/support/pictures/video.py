"""Video files that are playable whatever ends the writing.

Frames go to the file itself in fragments of a quarter of a second, each whole in itself: as
fragmented MP4, or Matroska for `.mkv`. So what a killed process leaves is a film of that name that
plays up to its last second. Closed, an MP4 is rewrapped, its index first, and takes the place of
the fragments in one move.

This is PyAV itself, not imageio's plugin for it: that sets neither the encoder's lookahead and
B-frames nor the colours, and writes through a buffer, so a killed process leaves more than a second
less (docs/decisions/films.md)."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from io import FileIO
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Any

from factory.support.claim import claimed
from factory.support.errors import Diagnostic, InputError, MissingError
from factory.support.files import partial_of, unwritten
from factory.support.interruption import put_off
from factory.support.pictures.ink import Pixels
from factory.support.resource import Closing

__all__ = ["Size", "VideoFile", "check_output"]

Size = tuple[int, int]
"""Width and height [px]."""

FPS = 30.0

FILMS, STILLS = (".mp4", ".mkv"), (".png",)

FRAGMENTS = {
    ".mp4": ("mp4", {"movflags": "empty_moov+default_base_moof", "frag_duration": "250000"}),
    ".mkv": ("matroska", {"cluster_time_limit": "250"}),
}
"""For each ending how it is written so that it can be cut off anywhere."""

ENCODERS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "libx264": {"crf": "19", "preset": "fast", "bf": "0"},
        "libvpx-vp9": {"crf": "30", "deadline": "good", "cpu-used": "4", "lag-in-frames": "0"},
    }
)
"""The encoders of films, the best first, with their options: H.264 and, where FFmpeg was built
without what is under the GPL, VP9. Neither reorders frames."""

LARGEST, SMALLEST = 7680, 16

HEADER = 4096
"""Room for the header of a film [bytes]."""


def check_output(
    path: Path | str, size: tuple[int, int], fps: float = 30.0, still: bool | None = False
) -> bool:
    """Whether a still is asked for, once ending, size and rate are known to be possible.

    `still`: True or False where only stills or films will do, None for either. Raises InputError
    (BadValue)."""
    ending = Path(path).suffix.lower()
    valid = STILLS if still else FILMS if still is False else FILMS + STILLS
    if ending not in valid:
        shown = f"'{ending}'" if ending else "no ending"
        raise _bad(f"'{Path(path).name}' has {shown}", f"valid endings: {', '.join(valid)}")
    width, height = size
    if not all(SMALLEST <= n <= LARGEST for n in size):
        raise _bad(
            f"the size {width}x{height} is out of range", f"{SMALLEST} to {LARGEST} either way"
        )
    if ending in FILMS:
        if width % 2 or height % 2:
            near = f"{width + width % 2}x{height + height % 2}"
            raise _bad(f"the size {width}x{height} is odd", f"H.264 needs even sizes: {near}")
        if not (isfinite(fps) and 0 < fps <= 240):
            raise _bad(f"{fps:g} frames per second are out of range", "for example 30; at most 240")
    return ending in STILLS


def _bad(message: str, hint: str) -> InputError:
    return InputError(Diagnostic("BadValue", message, None, hint))


class VideoFile(Closing):
    """A video (yuv420p) of exact size and rate, by the first of the ENCODERS that is there, which
    no other process writes meanwhile. Raises InputError where it cannot be written, MissingError
    where there is no encoder."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float) -> None:
        check_output(path, size, fps)
        self.path, self.frames, self.encoded = path, 0, 0
        self.coder = ThreadPoolExecutor(1, "video")
        self.pending: Future[None] | None = None
        av, encoder = _av(), _encoder()
        self.rate = rate = Fraction(fps).limit_denominator(1001)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self.claim = claimed(path)
            _reserve(path, self.claim)
            kind, options = FRAGMENTS[path.suffix.lower()]
            options = {**options, "flush_packets": "1"}
            self.container: Any = av.open(str(path), "w", format=kind, options=options)
        except OSError as error:
            raise unwritten(path, error) from error
        self.stream: Any = self.container.add_stream(encoder, rate=rate)
        self.stream.width, self.stream.height = size
        self.stream.pix_fmt = "yuv420p"
        codec = self.stream.codec_context
        codec.time_base = 1 / rate
        codec.gop_size = max(1, round(fps))
        codec.color_range, codec.colorspace = 1, 1
        codec.color_primaries, codec.color_trc = 1, 1
        codec.thread_count = 1
        ahead = {"rc-lookahead": str(min(8, int(fps / 8)))} if encoder == "libx264" else {}
        codec.options = {**ENCODERS[encoder], **ahead}

    def write(self, pixels: Pixels) -> None:
        """Add a frame (height, width, 3). It is encoded on a thread of its own while the next is
        drawn, and by that one alone: more are no faster, and the same pictures must give the same
        film (docs/decisions/films.md)."""
        with self._room():
            self._wait()
        self.pending = self.coder.submit(self._encode, pixels)
        self.frames += 1

    def _wait(self) -> None:
        """Until the frame under way is encoded; raises what went wrong with it."""
        pending, self.pending = self.pending, None
        if pending is not None:
            pending.result()

    def _encode(self, pixels: Pixels) -> None:
        frame = _av().VideoFrame.from_ndarray(pixels, format="rgb24")
        frame = frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
        frame.pts, frame.time_base = self.encoded, self.stream.codec_context.time_base
        self.container.mux(self.stream.encode(frame))
        self.encoded += 1

    def _flush(self) -> None:
        self.container.mux(self.stream.encode(None))

    def close(self) -> None:
        """Finish the file and give it its name; without a single frame there is none. Raises
        InputError (BadFile) where there is no room for it."""
        if self.container is None:
            return
        with self.claim, self._room():
            try:
                self._wait()
                if self.encoded:
                    self.coder.submit(self._flush).result()
            finally:
                self.coder.shutdown()
                self.container.close()
                self.container = None
                if not self.encoded:
                    self.path.unlink(missing_ok=True)
            if self.encoded and self.path.suffix.lower() == ".mp4":
                _rewrap(self.path, self.rate)

    @contextmanager
    def _room(self) -> Iterator[None]:
        """What fails to be written within it is this file."""
        try:
            yield
        except OSError as error:
            raise unwritten(self.path, error) from error


def _reserve(path: Path, file: FileIO) -> None:
    """Raises OSError, and leaves no file, where there is no room for a film's header: without it
    FFmpeg crashes at the end."""
    if not path.is_file():
        return
    try:
        os.posix_fallocate(file.fileno(), 0, HEADER)
    except OSError:
        file.close()
        path.unlink()
        raise
    file.truncate(0)


def _rewrap(path: Path, rate: Fraction) -> None:
    """The same video without fragments, its index first, as browsers like it. Without B-frames
    packet n is frame n, and its time n / rate."""
    av = _av()
    partial = partial_of(path)
    try:
        with (
            av.open(str(path)) as old,
            av.open(str(partial), "w", format="mp4", options={"movflags": "faststart"}) as new,
        ):
            stream = new.add_stream_from_template(old.streams.video[0])
            packets = (packet for packet in old.demux(video=0) if packet.size)
            for number, packet in enumerate(packets):
                packet.stream, packet.time_base = stream, 1 / rate
                packet.pts = packet.dts = number
                packet.duration = 1
                new.mux(packet)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _av() -> Any:
    try:
        with put_off():
            import av
    except ImportError as error:
        message = f"films need PyAV: {error}"
        raise MissingError(Diagnostic("NoVideo", message, None, "pip install av")) from error
    return av


def _encoder() -> str:
    """The name of the first encoder that FFmpeg has. Raises MissingError."""
    codec = _av().codec
    for name in ENCODERS:
        try:
            codec.Codec(name, "w")
        except codec.codec.UnknownCodecError:
            continue
        return name
    message = f"films need an encoder of FFmpeg: {', '.join(ENCODERS)}"
    raise MissingError(Diagnostic("NoVideo", message, None, "pip install av"))
