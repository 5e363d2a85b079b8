"""Declarations: the files of plug-ins and users, read, checked against JSON Schemas and held in pools."""
