"""An OPC UA server that gives nobody rights: who reaches it may read, subscribe, and write what is
writable. There are no accounts, and what one client can take is bounded, so that the clock of the
plant keeps its pace."""

from __future__ import annotations

import asyncio
from typing import Any

MOST_CLIENTS = 16
"""Upper bound on the connections at once."""

MOST_SUBSCRIPTIONS = 32
"""Upper bound on the subscriptions of all clients."""

MOST_ITEMS = 1000
"""Upper bound on the monitored items of all subscriptions."""

SHORTEST = 10.0
"""Shortest interval at which a subscription is published [ms]."""

LARGEST = 2**20
"""Upper bound on the bytes of a message."""

GRACE = 5.0
"""A connection without a session, and a session without a connection, are kept so long [s]."""


class OpcuaServer:
    """A server at an `address`, made with the package `ua`. `server`: that of the package."""

    def __init__(self, ua: Any, address: str) -> None:
        self._ua, self.server = ua, ua.Server()
        inner = self.server.iserver
        inner.max_connections, inner.max_subscriptions = MOST_CLIENTS, MOST_SUBSCRIPTIONS
        inner.max_pending_activation_seconds = GRACE
        inner.max_session_timeout_ms = inner.min_session_timeout_ms = 1000 * GRACE
        self.server.limits.max_message_size = LARGEST
        self.server.allow_remote_admin(False)
        self.server.set_identity_tokens([ua.ua.AnonymousIdentityToken])
        self.server.set_security_policy([ua.ua.SecurityPolicyType.NoSecurity])
        self.server.set_endpoint(address)
        self.server.set_server_name("factory")

    async def start(self) -> None:
        """Listen."""
        service = self._subscriptions
        create = service.create_subscription

        async def create_bounded(asked: Any, *others: Any, **named: Any) -> Any:
            wanted = asked.RequestedPublishingInterval
            asked.RequestedPublishingInterval = wanted if wanted > SHORTEST else SHORTEST
            return await create(asked, *others, **named)

        service.create_subscription = create_bounded
        await self.server.start()

    @property
    def port(self) -> int:
        """The port at which it listens."""
        return int(self.server.bserver._server.sockets[0].getsockname()[1])

    @property
    def _subscriptions(self) -> Any:
        return self.server.iserver.subscription_service

    async def tidy(self) -> None:
        """Drop the subscriptions of clients that are gone, and the newest of those that monitor
        more items than all may."""
        sessions = (c.processor and c.processor.session for c in self.server.bserver.clients)
        present = {session.session_id for session in sessions if session is not None}
        dropped, items = list[int](), 0
        for number, subscription in self._subscriptions.subscriptions.items():
            items += len(subscription.monitored_item_srv._monitored_items)
            if subscription.session_id not in present or items > MOST_ITEMS:
                dropped.append(number)
        if dropped:
            await self._subscriptions.delete_subscriptions(dropped)

    async def tell(self, events: Any, message: str) -> None:
        """Send an event to all subscriptions; one whose filter fails is dropped."""
        for number in [*self._subscriptions.subscriptions]:
            try:
                await events.trigger(message=message, subscription_id=number)
            except Exception:
                await self._subscriptions.delete_subscriptions([number])

    async def stop(self) -> None:
        """Disconnect all clients, and end what sessions have left behind."""
        await self.server.stop()
        left = asyncio.all_tasks() - {asyncio.current_task()}
        for task in left:
            task.cancel()
        await asyncio.gather(*left, return_exceptions=True)
