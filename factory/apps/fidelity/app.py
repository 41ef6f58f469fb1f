"""What the app `fidelity` gives."""

from factory.support.apps import App

APP = App("fidelity", commands={"fidelity": "factory.apps.fidelity.command_line.fidelity:fidelity"})
