"""What the app `fidelity` gives."""

from factory.api import App

APP = App("fidelity", commands={"fidelity": "factory.apps.fidelity.command_line.fidelity:fidelity"})
