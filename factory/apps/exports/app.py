"""What the app `exports` gives."""

from factory.api import App

APP = App("exports", commands={"export": "factory.apps.exports.command_line.export:export"})
