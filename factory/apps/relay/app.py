"""What the app for relays gives."""

from factory.support.apps import App

APP = App("relay", layouts={"relay": "factory.apps.relay.relaying:relay"})
