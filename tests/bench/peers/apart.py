"""Runs commands each from a small process of its own, and tells what they cost.

Linux counts towards the peak memory of a program what the process that started it held at that time (it is carried over
`exec`). A caller that holds images would add them to every tool it measures.
"""
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time


def timed(command, limit_s=None, log=subprocess.PIPE, cwd=None):
    """Runs a command; its standard output and what it cost: wall_s, cpu_s, memory_mib.

    Past `limit_s` everything that it started is ended (subprocess.TimeoutExpired); RuntimeError where it fails.
    """
    command = [str(word) for word in command]
    with tempfile.NamedTemporaryFile() as cost:
        child = subprocess.Popen([sys.executable, os.path.abspath(__file__), cost.name, *command], stdout=log, stderr=log,
                                 text=True, start_new_session=True, cwd=cwd)
        try:
            out, err = child.communicate(timeout=limit_s)
        except BaseException:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            raise
        if child.returncode:
            raise RuntimeError(f"{' '.join(command[:2])} failed: {(err or '')[-800:]}")
        return out, json.load(cost)


def main():
    start = time.time()
    status = subprocess.call(sys.argv[2:])
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(sys.argv[1], "w") as file:
        json.dump({"wall_s": time.time() - start, "cpu_s": usage.ru_utime + usage.ru_stime,
                   "memory_mib": usage.ru_maxrss / 1024}, file)
    sys.exit(status)


if __name__ == "__main__":
    main()
