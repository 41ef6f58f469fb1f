"""Apps: each uses the core, and the core knows none.

Where an app has a module `app`, its `APP` names the commands and variants that it gives
(`factory/support/apps.py`); its folder `command_line` has the commands.
"""
