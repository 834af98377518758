"""`python -m polyins`."""

from polyins.cli import main

main()
