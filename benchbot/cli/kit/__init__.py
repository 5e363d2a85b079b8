"""The parts that commands are made of, for plug-ins as well: console, options, status line, interruption."""
