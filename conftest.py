"""What every test has in common."""

from hypothesis import settings

# A busy machine makes nothing wrong: no test has a deadline.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")
