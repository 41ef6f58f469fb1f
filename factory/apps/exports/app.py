"""What the app `exports` gives."""

from factory.support.apps import App

APP = App("exports", commands={"export": "factory.apps.exports.command_line.export:export"})
