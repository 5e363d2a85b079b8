"""The command line as a module: `python -m benchbot`."""

from benchbot.cli.app import main

main()
