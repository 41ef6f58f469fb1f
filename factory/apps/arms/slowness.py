"""Ways through given configurations: a polyline in joint space, its corners rounded, with the least
coordinate for which property (∗) holds.

The path P(t) has a parameter t of its own. Its coordinate grows by V/f(t), where f, the greatest
rate of t at the speed V, is found by a forward and a backward pass: |P"| f² + |P'| f (A/V) +
|P'| f |f'| <= a for each joint, |P'| f <= v, and the tool's speed. 1/f is the slowness.
"""

from __future__ import annotations

import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.support.arrays import Array

STEP, FEWEST, MOST = 0.0015, 600, 4000
"""The spacing of samples of t [s at the joints' full speed], and bounds on their number."""

KNOTS, PLACES = 200, 400
"""Numbers of knots of a way, and of places on it at which the tool's speed is computed."""

STIFF = 0.47, 0.47
"""Shares of the straight beginning and end that are not rounded: 40 of 85 mm."""

RESERVE = 0.93, 0.98
"""Shares of acceleration and speed that the passes use: the spline differs from its samples."""

LEAST_GAIN = 0.02
"""The rate may always rise by so much, or it would never leave a standstill."""

SMOOTH = 0.02
"""Slowness is a mean over twice this width of t."""


def box_average(t: Array, path: Array, half: Array) -> Array:
    """The mean (m, n) of a polyline over [t - w, t + w]; the polyline itself where w is 0.

    Args:
        t: parameters in ascending order (m,).
        path: points of the polyline there (m, n).
        half: half widths w (m,), none of which reaches beyond the ends.
    """
    step = np.diff(t)[:, None]
    pieces = (path[1:] + path[:-1]) / 2 * step
    total = np.concatenate([np.zeros((1, path.shape[1])), np.cumsum(pieces, axis=0)])

    def integral(at: Array) -> Array:
        k = np.clip(np.searchsorted(t, at, "right") - 1, 0, len(t) - 2)
        off = (at - t[k])[:, None]
        slope = (path[k + 1] - path[k]) / step[k]
        return np.asarray(total[k] + off * (path[k] + off * slope / 2))

    mean, wide = path.copy(), half > 1e-9
    low, high = t[wide] - half[wide], t[wide] + half[wide]
    mean[wide] = (integral(high) - integral(low)) / (high - low)[:, None]
    return mean


def smooth_majorant(values: Array, count: int) -> Array:
    """A smooth sequence (m,) that is nowhere below another: the mean over a window of the greatest
    over that window.

    Args:
        values: the sequence (m,).
        count: half width of the window.
    """
    count = max(1, count)
    padded = np.pad(values, 2 * count, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * count + 1)
    mean = np.full(2 * count + 1, 1 / (2 * count + 1))
    return np.asarray(np.convolve(windows.max(axis=1), mean, "valid"))


def way_through(
    chain: SerialChain,
    out: Array,
    middle: Array,
    into: Array,
    pace: WayLimits,
    stiff: tuple[float, float] = STIFF,
    rounding: float = 0.1,
) -> JointWay:
    """The way along a straight beginning, a transfer and a straight end, with (∗).

    Args:
        chain: the arm.
        out: configurations along the beginning, in the order of the way (k, n) [rad, m].
        middle: those of a polyline from the last of `out` to the first of `into` (l, n).
        into: configurations along the end, in the order of the way (k, n).
        pace: limits of the coordinate and the tool.
        stiff: shares of the straight beginning and end that are not rounded.
        rounding: greatest half width of the average that rounds corners [s at the joints' full
            speed].
    """
    rows = np.concatenate([out, middle[1:-1], into])
    steps = np.abs(np.diff(rows, axis=0) / chain.limits.speed).max(axis=1)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    t = np.linspace(0.0, time[-1], int(np.clip(time[-1] / STEP, FEWEST, MOST)))
    path = np.stack([np.interp(t, time, row) for row in rows.T], axis=1)
    for part, at in ((out, time[: len(out)]), (into, time[len(rows) - len(into) :])):
        inside = (t >= at[0]) & (t <= at[-1])
        path[inside] = JointWay(at - at[0], part).at(t[inside] - at[0])[0]
    corners = stiff[0] * (len(out) - 1), len(rows) - 1 - stiff[1] * (len(into) - 1)
    first, last = (float(v) for v in np.interp(corners, np.arange(len(rows)), time))
    for _ in range(2):
        half = np.clip(np.minimum(t - first, last - t) / 2, 0.0, rounding)
        path = box_average(t, path, half)
    return enforce_limits(_through_samples(chain, t, path, (first, last), pace), chain, pace)


def _through_samples(
    chain: SerialChain, t: Array, path: Array, ends: tuple[float, float], pace: WayLimits
) -> JointWay:
    """The way through about KNOTS of a path's samples; `ends`: parameters where the straight
    beginning ends and the straight end begins."""
    x = coordinates(chain, t, path, pace)
    wanted = np.interp(np.linspace(0.0, x[-1], KNOTS), x, np.arange(len(x)))
    pick = np.unique(np.round(wanted).astype(int))
    off, hover = np.interp(ends, t, x).tolist()
    return JointWay(x[pick], path[pick], off, hover)


def enforce_limits(way: JointWay, chain: SerialChain, pace: WayLimits) -> JointWay:
    """A way, stretched as little as (∗) and the tool's speed need.

    Args:
        way: of any length.
        chain: the arm.
        pace: limits of the coordinate and the tool.
    """
    first, second = way.bounds()
    fast, push = first * pace.speed, first * pace.acceleration
    most = chain.limits.acceleration
    bend = np.sqrt(push**2 + 4 * most * second * pace.speed**2)
    share = max(
        float((fast / chain.limits.speed).max()),
        float(((push + bend) / (2 * most)).max()),
        float(tool_shares(chain, way, pace).max()),
    )
    return way.stretch(share * (1 + 1e-12)) if share > 1.0 else way


def tool_shares(chain: SerialChain, way: JointWay, pace: WayLimits) -> Array:
    """The shares of its limit (PLACES,) that the tool's speed has at equal distances along a way,
    where the coordinate has its greatest speed.

    Args:
        chain: the arm.
        way: followed by it.
        pace: limits of the coordinate and the tool.
    """
    q, first, _ = way.at(np.linspace(0.0, way.length, PLACES))
    tool, _, columns = chain.tool_and_jacobian(q)
    speed = np.linalg.norm((columns[:, :3] @ first[..., None])[..., 0], axis=1) * pace.speed
    return np.asarray(speed / _tool_limits(tool, pace))


def _tool_limits(tool: Array, pace: WayLimits) -> Array:
    """The tool's greatest speed (m,) at places (m, 3) along a way [m/s]."""
    gone = np.cumsum(np.linalg.norm(np.diff(tool, axis=0, prepend=tool[:1]), axis=1))
    beyond = np.maximum(np.minimum(gone, gone[-1] - gone) - pace.end_zone, 0.0)
    speed = np.sqrt(pace.end_speed**2 + 2 * pace.tool_gain * beyond)
    return np.asarray(np.minimum(speed, pace.tool_speed))


def coordinates(chain: SerialChain, t: Array, path: Array, pace: WayLimits) -> Array:
    """Coordinates (m,) from 0 of a path's samples [m].

    Args:
        chain: the arm.
        t: parameters at equal distances (m,).
        path: configurations there (m, n) [rad, m].
        pace: limits of the coordinate and the tool.
    """
    step, ratio = float(t[1] - t[0]), pace.acceleration / pace.speed
    first = np.abs(np.gradient(path, t, axis=0))
    second = np.abs(np.gradient(np.gradient(path, t, axis=0), t, axis=0))
    most = RESERVE[0] * chain.limits.acceleration
    rate = _rates(chain, t, path, pace)
    rate = np.minimum(rate, RESERVE[1] * _least_ratio(chain.limits.speed, first))
    rate = np.minimum(rate, _bend_rates(first * ratio, second, most))
    rate = 1 / smooth_majorant(1 / rate, round(SMOOTH / step))
    square = _passes(rate**2, first, second, most, ratio, step)
    slowness = smooth_majorant(pace.speed / np.sqrt(square), round(SMOOTH / step / 2))
    return np.concatenate([[0.0], np.cumsum((slowness[1:] + slowness[:-1]) / 2 * step)])


def _least_ratio(most: Array, values: Array) -> Array:
    """The least of the ratios of limits (n,) to values (m, n) that are not 0 (m,)."""
    return np.asarray((most / np.maximum(values, 1e-12)).min(axis=1))


def _rates(chain: SerialChain, t: Array, path: Array, pace: WayLimits) -> Array:
    """The greatest rates of t (m,) within the tool's speed."""
    tool, _ = chain.tool(path)
    speed = np.linalg.norm(np.gradient(tool, t, axis=0), axis=1)
    return np.asarray(RESERVE[1] * _tool_limits(tool, pace) / np.maximum(speed, 1e-12))


def _bend_rates(push: Array, second: Array, most: Array) -> Array:
    """The greatest rates f (m,) with second f² + push f <= most for every joint."""
    root = push + np.sqrt(push**2 + 4 * second * most)
    return np.asarray((2 * most / np.maximum(root, 1e-12)).min(axis=1))


def _passes(
    square: Array, first: Array, second: Array, most: Array, ratio: float, step: float
) -> Array:
    """Squares of rates (m,), lessened until no joint's acceleration is too great for the rate to
    rise as it does: from the beginning to the end, and back."""
    square = square.copy()
    inverse = 1 / np.maximum(first, 1e-9)
    for way in (1, -1):
        here, slope, bend, less = (a[::way] for a in (square, first, second, inverse))
        for k in range(len(here) - 1):
            left = most - ratio * slope[k] * here[k] ** 0.5 - bend[k] * here[k]
            gain = max(float((left * less[k]).min()), LEAST_GAIN)
            here[k + 1] = min(here[k + 1], here[k] + 2 * gain * step)
    return square
