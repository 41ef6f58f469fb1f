"""What the app `live` gives."""

from factory.api import App

APP = App("live", commands={"view": "factory.apps.live.command_line.view:view"})
