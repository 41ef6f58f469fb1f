"""What the app for relays gives."""

from factory.api import App

APP = App("relay", layouts={"relay": "factory.apps.relay.relaying:relay"})
