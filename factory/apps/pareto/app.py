"""What the app `pareto` gives."""

from factory.api import App

APP = App("pareto", commands={"pareto": "factory.apps.pareto.command_line.pareto:pareto"})
