"""What the app `report` gives."""

from factory.api import App

APP = App("report", commands={"report": "factory.apps.report.command_line.report:report"})
