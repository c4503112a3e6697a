"""Two workers on one data folder: the one that has the job is stopped past its lease, the other finishes the job, the first goes
on, and changes nothing."""
import json
import signal
import sqlite3
import tempfile
import time

from service import Service, Study, Worker, arguments

LEASE = ("--lease-seconds", "4")  # longer than a busy machine keeps a worker from renewing it


def rows(data):
    database = sqlite3.connect(f"file:{data}/kinevox.db?mode=ro", uri=True)
    try:
        return (database.execute("SELECT * FROM job ORDER BY seq").fetchall(),
                database.execute("SELECT * FROM job_event ORDER BY id").fetchall(),
                database.execute("SELECT * FROM model ORDER BY seq").fetchall())
    finally:
        database.close()


def wait_until(condition, what, seconds=120):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if condition():
            return
        time.sleep(0.02)
    raise AssertionError(what)


def stop_between_writes(service, worker):
    """A process that is stopped in the middle of a write keeps the database's lock, as it would keep any: try another moment."""
    for _ in range(100):
        worker.process.send_signal(signal.SIGSTOP)
        status, _, _ = service.ask("POST", "/v1/subjects", {"region": "custom"})
        if status == 201:
            return
        worker.process.send_signal(signal.SIGCONT)
        time.sleep(0.05)
    raise AssertionError("the worker always writes")


def main():
    options = arguments(__doc__)
    study = Study(options.study)
    with tempfile.TemporaryDirectory() as data:
        service = Service(options.program, data, "--workers", "0", "--log", "error", *LEASE)
        first = Worker(options.program, data, *LEASE)
        second = None
        try:
            subject = study.send(service)
            job = service.must("POST", "/v1/models", study.model_request(subject))["job"]
            wait_until(lambda: service.must("GET", f"/v1/jobs/{job}")["stage"] not in ("", "load"), "no worker takes the job")
            stop_between_writes(service, first)
            second = Worker(options.program, data, *LEASE)
            ended = service.wait_for(job)
            assert ended["state"] == "succeeded", ended
            assert ended["attempt"] >= 2, ended
            before = rows(data)
            first.process.send_signal(signal.SIGCONT)
            wait_until(lambda: "job lost" in first.log(), "the late worker does not notice that it is late")
            assert rows(data) == before, "the late worker has changed something"
            assert first.alive() and second.alive() and service.alive()
            # Both still work.
            again = service.wait_for(service.must("POST", "/v1/models", study.model_request(subject))["job"])
            assert again["result"]["digest"] == ended["result"]["digest"]
            assert first.end(signal.SIGTERM) == 0 and second.end(signal.SIGTERM) == 0, "a stop on request is no failure"
            print(json.dumps({"digest": ended["result"]["digest"], "attempt": ended["attempt"]}))
        finally:
            for process in filter(None, (first, second, service)):
                process.end()


if __name__ == "__main__":
    main()
