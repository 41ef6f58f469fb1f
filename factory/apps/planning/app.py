"""What the app `planning` gives."""

from factory.support.apps import App

APP = App("planning", commands={"plan": "factory.apps.planning.command_line.plan:plan"})
