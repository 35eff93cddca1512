"""The command `coulomb`: assembles the commands and turns errors into exit statuses.

Exit status: 0 done; 2 the input or the arguments are wrong; 1 anything else.
"""

import importlib
import pkgutil
import sys

import typer

import api.commands
from identify.recording.errors import InputError

application = typer.Typer(
    name="coulomb",
    help="Measure a robot joint, identify its model, and learn which physical effect the model misses.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _register_commands() -> None:
    """Let every module of `api.commands` add its command by its function `register(application)`."""
    for module in sorted(pkgutil.iter_modules(api.commands.__path__), key=lambda found: found.name):
        importlib.import_module(f"api.commands.{module.name}").register(application)


def main() -> None:
    """Run the command line; the entry point of the script `coulomb`."""
    _register_commands()
    try:
        application()
    except InputError as error:
        print(f"coulomb: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    except KeyboardInterrupt:
        print("coulomb: interrupted", file=sys.stderr)
        raise SystemExit(1) from None
    except Exception as error:
        print(f"coulomb: {type(error).__name__}: {error}", file=sys.stderr)
        raise SystemExit(1) from error
