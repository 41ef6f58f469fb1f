"""What the app `live` gives."""

from factory.support.apps import App

APP = App("live", commands={"view": "factory.apps.live.command_line.view:view"})
