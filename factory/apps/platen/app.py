"""What the app for platens gives."""

from factory.api import App

APP = App("platen", layouts={"platen": "factory.apps.platen.platen:platen"})
