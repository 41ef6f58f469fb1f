"""What the app `revise` gives."""

from factory.api import App

APP = App(
    "revise",
    commands={
        "mix": "factory.apps.revise.command_line.mix:mix",
        "revise": "factory.apps.revise.command_line.revise:revise",
    },
)
