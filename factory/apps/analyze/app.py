"""What the app `analyze` gives."""

from factory.support.apps import App

APP = App("analyze", commands={"analyze": "factory.apps.analyze.command_line.analyze:analyze"})
