"""What the app for platens gives."""

from factory.support.apps import App

APP = App("platen", layouts={"platen": "factory.apps.platen.platen:platen"})
