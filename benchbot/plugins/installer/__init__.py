"""Installing plug-ins without fear: what would change is shown first, and what fails is undone to the last file."""
