"""What the app `sweep` gives."""

from factory.api import App

APP = App("sweep", commands={"sweep": "factory.apps.sweep.command_line.sweep:sweep"})
