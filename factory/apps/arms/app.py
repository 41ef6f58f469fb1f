"""What the app for articulated arms gives."""

from factory.api import App

APP = App("arms")
