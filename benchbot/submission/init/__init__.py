"""The leader of a solution: a small process that starts it, confines it, and ends whatever it leaves behind.

It runs without `site` and inside of sandboxes, so the modules in here import nothing but the standard library.
"""
