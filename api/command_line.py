"""The command `coulomb`: assembles the commands and turns errors into exit statuses.

Exit status: 0 done; 2 the input or the arguments are wrong; 1 anything else.
"""

import atexit
import contextlib
import gc
import importlib
import io
import os
import pkgutil
import sys
from collections.abc import Sequence
from typing import Annotated, Any, NoReturn

import typer

import api.commands

application = typer.Typer(
    name="coulomb",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"coulomb {version('coulomb')}")
        except PackageNotFoundError:
            print("coulomb, from its source tree")
        raise typer.Exit


@application.callback()
def coulomb(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="print the version, and end"),
    ] = False,
) -> None:
    """Measure a robot joint, identify its model, and learn which physical effect the model misses."""


def _register_commands(asked: str) -> None:
    """Let the modules of `api.commands` add their commands by their function `register(application)`.

    Where a module has the name of the command asked for, it is enough; the others would cost every command their
    time. All of them are needed for the overview, and for a command that is not the first of its module.
    """
    modules = sorted(module.name for module in pkgutil.iter_modules(api.commands.__path__))
    for name in [name for name in modules if name.rstrip("_") == asked] or modules:
        importlib.import_module(f"api.commands.{name}").register(application)


HOLD_NOTHING = ("compare", "diagnose", "effects", "identify", "improve", "next", "simulate")
"""Commands that read, compute and print: at their end no file, data base or device is open that wants to be closed."""


def run() -> NoReturn:
    """The entry point of the script `coulomb`: `main`, after which a command that holds nothing ends at once.

    The interpreter would free every module and all they refer to one by one, a fortieth of the processor time of `identify`.
    """
    status = 1

    def end_at_once() -> None:
        # Where nobody reads any more the interpreter says so in its own way.
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)

    if next(iter(sys.argv[1:]), "") in HOLD_NOTHING:
        atexit.register(end_at_once)  # the first one registered is called last, when all threads have ended
    try:
        main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
        raise
    raise SystemExit(0)


def main() -> None:
    """Run the command line; ends by `SystemExit`."""
    # Read when NumPy is loaded. The computations use one thread for linear algebra anyway (`single_threaded`), and
    # threads that OpenBLAS starts all the same spin while they wait: a sixth of the processor time of `identify`.
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # Arrow's own allocator takes memory in huge pages, which the kernel clears whole: for what a recording needs of them, a
    # thirtieth of the processor time of `identify`.
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    # pydantic would look through the entry points of everything that is installed for plug-ins; no command has a use for one.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # What is imported stays until the end. The collector, which would look at all of it after every 700 new objects, takes
    # a twentieth of the processor time of `identify`; cycles of longer commands are still found, a few MB later.
    gc.set_threshold(100_000)
    try:
        _run()
    finally:
        # The interpreter would walk through all that was ever imported, twice, to free it one by one; the end of the
        # process frees it at once. That walk was a ninth.
        gc.freeze()


CTRL_C = 130
"""what typer answers where Ctrl-C ended a command"""


def _run() -> None:
    try:
        _command()
    except KeyboardInterrupt:  # also while modules are loaded
        print("coulomb: interrupted", file=sys.stderr)
        raise SystemExit(1) from None


def _command() -> None:
    _require_text(sys.argv[1:])
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(
            errors="replace"
        )  # a terminal of an older encoding lacks '‖' and '²'; JSON stays JSON
    _register_commands(next(iter(sys.argv[1:]), ""))
    from identify.recording.errors import InputError

    try:
        status = application(prog_name="coulomb", standalone_mode=False)
        if status == CTRL_C:
            raise KeyboardInterrupt
        raise SystemExit(status)
    except InputError as error:
        print(f"coulomb: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    except typer.Abort:
        raise KeyboardInterrupt from None
    except Exception as error:
        if hasattr(error, "format_message"):  # what typer raises where the arguments are wrong
            raise SystemExit(_wrong_arguments(error)) from None
        print(f"coulomb: {type(error).__name__}: {error}", file=sys.stderr)
        raise SystemExit(1) from error


def _require_text(arguments: Sequence[str]) -> None:
    """Ends with status 2 where an argument, a file's name say, is no text: it could stand in no document."""
    for argument in arguments:
        try:
            argument.encode()
        except UnicodeEncodeError:
            said = argument.encode("utf-8", "backslashreplace").decode()
            print(
                f"coulomb: '{said}': not UTF-8; rename the file, or set a UTF-8 locale (LC_ALL=C.UTF-8)",
                file=sys.stderr,
            )
            raise SystemExit(2) from None


def _wrong_arguments(error: Any) -> int:
    """Say in one line what is wrong; returns the exit status. Without a command typer has shown the help already."""
    if error.format_message():
        command = "coulomb" if error.ctx is None else error.ctx.command_path
        print(f"coulomb: {error.format_message().rstrip('.')}; see {command} --help", file=sys.stderr)
    return 2
