"""`python -m factory`."""

from factory.commands import main

main()
