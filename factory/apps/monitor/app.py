"""What the app `monitor` gives."""

from factory.support.apps import App

APP = App("monitor", commands={"monitor": "factory.apps.monitor.command_line.monitor:monitor"})
