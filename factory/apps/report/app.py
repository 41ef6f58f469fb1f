"""What the app `report` gives."""

from factory.support.apps import App

APP = App("report", commands={"report": "factory.apps.report.command_line.report:report"})
