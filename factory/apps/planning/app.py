"""What the app `planning` gives."""

from factory.api import App

APP = App("planning", commands={"plan": "factory.apps.planning.command_line.plan:plan"})
