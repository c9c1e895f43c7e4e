"""`python -m geoprint` is the command `geoprint`."""

from geoprint.cli import main

main()
