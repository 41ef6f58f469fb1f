"""The share of a hand's strength that a load uses, by the hand's shape."""

from __future__ import annotations

import numpy as np

from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.tips import tip
from factory.support.arrays import Array
from factory.support.boxes import Point2


def middle(hand: Hand) -> Array:
    """The middle (3,) of a hand's tips, in the frame of the product [m]."""
    return np.asarray(np.mean(hand.places, axis=0))


def outward(hand: Hand, heading: Point2) -> Array:
    """Direction from the face of a hand's tips to the payload (3,), for a robot with a heading."""
    return np.array(hand.kind.toward(heading))


def gauge(hand: Hand, heading: Point2, tour: int = 0) -> Array:
    """From a force [N] and a moment [Nm] about the middle of a hand's tips to the terms of what
    they use of its strength on a tour (11, 6), as `tips.shares` takes them."""
    if hand.clamp is not None:
        return hand.clamp.gauge(heading, tour)
    apart = np.subtract(hand.places[-1], hand.places[0])
    terms = tip(hand.tip).gauge(outward(hand, heading), np.array(hand.radius), apart)
    return terms / hand.covered[tour]
