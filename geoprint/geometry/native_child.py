"""The child process in which native code works on untrusted data, run as a script so that it imports little.

    python -I native_child.py WORKER PARENT MEMORY_BYTES SECONDS ARGUMENT...

WORKER is a script whose `work` turns the bytes of stdin and the arguments into the bytes that go to stdout: no file
lies anywhere that somebody would have to remove. The process ends with its parent, however that ends.
"""

from __future__ import annotations

import os
import runpy
import signal
import sys
import threading
import time

# What Linux calls the signal that a process is sent when its parent is gone.
PR_SET_PDEATHSIG = 1
# Elsewhere it looks for its parent so often [s].
WATCHED_EACH = 0.5


def main() -> None:
    """Work by the command line."""
    worker, parent, memory, seconds, *arguments = sys.argv[1:]
    # Libraries print to stdout, too.
    answer = os.dup(1)
    os.dup2(2, 1)
    end_with(int(parent))
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    content = runpy.run_path(worker)["work"](sys.stdin.buffer.read(), *arguments)
    with os.fdopen(answer, "wb") as stream:
        stream.write(content)


def end_with(parent: int) -> None:
    """Let this process end with its parent: by the system where it can, for native code holds up every thread."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    elif sys.platform != "win32":
        threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    if sys.platform != "win32" and os.getppid() != parent:
        os._exit(1)  # it was gone before


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(WATCHED_EACH)
    os._exit(1)


if __name__ == "__main__":
    main()
