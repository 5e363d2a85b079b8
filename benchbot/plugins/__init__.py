"""The plug-ins that ship in the box: one folder, one capability, one `plugin.py`, one entry point."""
