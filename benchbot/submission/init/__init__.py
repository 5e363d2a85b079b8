"""The init process of a solution: a small process that starts it, confines it, and ends everything it leaves behind.

It runs without `site` and inside of sandboxes, so these modules import nothing but the standard library.
"""
