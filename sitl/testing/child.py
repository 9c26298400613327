"""Runs `python -m sitl` for a test and ends it when the test's process is gone, however that came about.

The standard input is a pipe whose other end only the test's process has: it reads as ended once that has died, be it
by SIGKILL, and then nobody is left who could end the vehicle.
"""

import os
import runpy
import signal
import threading
import time

STDIN = 0
GRACE = 5.0  # to end by itself [s]


def _end_with_the_test() -> None:
    while os.read(STDIN, 4096):  # past Python's buffers, whose locks a thread may not hold as the process ends
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_end_with_the_test, name="end with the test", daemon=True).start()
    runpy.run_module("sitl", run_name="__main__", alter_sys=True)
