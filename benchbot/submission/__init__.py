"""Submissions: a solution as a process, run against a back end, and its results."""
