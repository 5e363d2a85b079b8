"""The platform of a run: a simulator or a robot driver in a child process."""
