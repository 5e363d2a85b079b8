"""Checking files before they are used: declarations, documents, projects of plug-ins."""
