"""What the app `importing` gives."""

from factory.api import App

APP = App("importing", commands={"import": "factory.apps.importing.command_line.import_:import_"})
