"""How the command line ends: its exit status, one sentence for a person, and with `--json` an object for programs.

What this module needs is imported where it is needed: until `main` runs, nothing answers Ctrl-C.
"""

from __future__ import annotations

import gc
import sys

# So many new objects are made before cycles among them are looked for: next to nothing here is part of one, and to look
# as often as Python does by itself takes 3 % of a plan.
LOOKED_FOR_CYCLES = 50_000
STOPPED_BY_USER = 130
KEPT = "nothing was written, and what was there before is kept."
DEFECT = 1

# What this process has written, for whoever stops it.
_WRITTEN: list[str] = []


def main() -> None:
    """Run the command line and end the process with the exit status of the outcome."""
    gc.set_threshold(LOOKED_FOR_CYCLES)
    _WRITTEN.clear()
    try:
        from geoprint.cli.application import run

        status = run(sys.argv[1:])
    except SystemExit as end:
        if not isinstance(end.__context__, BrokenPipeError):
            raise
        # The reader of the help is gone.
        status = 0
    except BaseException as error:
        status = _ended(error)
    sys.exit(status)


def wrote(place: object, remark: str = "written") -> None:
    """Say that a result stands in its place, which holds even if the command is stopped later."""
    from geoprint.cli.terminal import say

    _WRITTEN.append(str(place))
    say(f"{remark}: {place}")


def error_object(error: BaseException, status: int) -> dict[str, object]:
    """Return what `--json` prints of an error: its sentence, its class, the exit status and the numbers it names."""
    from geoprint.errors import GeoprintError

    return {
        "error": str(error) or type(error).__name__,
        "kind": type(error).__name__,
        "exit_status": status,
        "details": error.details if isinstance(error, GeoprintError) else {},
    }


def _ended(error: BaseException) -> int:
    """Say why the work ended, and return the exit status of that."""
    if _is_interrupt(error):
        # A second Ctrl-C ends what is still being tidied up, at once.
        import signal

        signal.signal(signal.SIGINT, signal.SIG_DFL)
        kept = (
            f"kept: {', '.join(_WRITTEN)}." if _WRITTEN else "nothing was written, and what was there before is kept."
        )
        if "--json" in sys.argv:
            import json

            stopped = {"error": f"stopped; {kept}", "kind": "Stopped", "exit_status": STOPPED_BY_USER}
            sys.stdout.write(f"{json.dumps(stopped)}\n")
        sys.stderr.write(f"geoprint: stopped; {kept}\n")
        return STOPPED_BY_USER
    import traceback
    from contextlib import suppress

    from geoprint.cli.terminal import print_json, say
    from geoprint.errors import GeoprintError, ResourceError

    if isinstance(error, MemoryError):
        error = ResourceError("out of memory; choose a larger spacing or a smaller part.")
    known = isinstance(error, GeoprintError)
    status = error.exit_status if isinstance(error, GeoprintError) else DEFECT
    if not known:
        # The one place where a defect may end: with its traceback.
        traceback.print_exception(error)
    if "--json" in sys.argv:
        with suppress(GeoprintError):
            print_json(error_object(error, status))
    say(f"geoprint: {error if known else 'this is a defect of geoprint; please report it with the lines above.'}")
    return status


def _is_interrupt(error: BaseException | None) -> bool:
    """Say whether Ctrl-C is at the bottom of an error: a library may have answered it with one of its own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
