"""New plug-ins: complete, tested projects from templates."""
