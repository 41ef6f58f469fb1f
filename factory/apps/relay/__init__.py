"""Relays: a guidepath that sets the pace is shared by several robots, which hand over to each
other."""

from factory.apps.relay.relaying import relayed

__all__ = ["relayed"]
