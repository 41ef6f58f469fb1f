"""What the app `plc` gives."""

from factory.support.apps import App

APP = App("plc", commands={"plant": "factory.apps.plc.command_line.plant:plant"})
