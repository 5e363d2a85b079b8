"""The first solutions to read and to run."""
