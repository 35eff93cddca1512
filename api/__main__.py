"""`python -m api` is the command `coulomb`."""

from api.command_line import run

run()
