"""What the app `plc` gives."""

from factory.api import App

APP = App("plc", commands={"plant": "factory.apps.plc.command_line.plant:plant"})
