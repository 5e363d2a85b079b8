"""Diagnosis of a machine, of what is installed on it, and of real robots."""
