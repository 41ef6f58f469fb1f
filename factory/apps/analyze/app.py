"""What the app `analyze` gives."""

from factory.api import App

APP = App("analyze", commands={"analyze": "factory.apps.analyze.command_line.analyze:analyze"})
