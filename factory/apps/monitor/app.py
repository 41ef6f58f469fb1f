"""What the app `monitor` gives."""

from factory.api import App

APP = App("monitor", commands={"monitor": "factory.apps.monitor.command_line.monitor:monitor"})
