"""What the app `making` gives."""

from factory.api import App

APP = App("making", commands={"make": "factory.apps.making.command_line.make:make"})
