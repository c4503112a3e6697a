"""A job that kills whoever runs it: after three workers it has failed, and says why; the service never stops answering."""
import json
import signal
import tempfile
import time

from service import Service, Study, Worker, arguments

LEASE = ("--lease-seconds", "1")


def main():
    options = arguments(__doc__)
    study = Study(options.study)
    with tempfile.TemporaryDirectory() as data:
        service = Service(options.program, data, "--workers", "0", "--log", "error", *LEASE)
        try:
            subject = study.send(service)
            job = service.must("POST", "/v1/models", study.model_request(subject))["job"]
            for lost in range(3):
                worker = Worker(options.program, data, *LEASE)
                while service.must("GET", f"/v1/jobs/{job}")["attempt"] <= lost:
                    time.sleep(0.02)
                worker.end(signal.SIGKILL)  # as a crash of its driver would
            ended = service.wait_for(job)
            assert ended["state"] == "failed", ended
            assert "three times" in ended["error"]["detail"], ended
            # Another worker still takes other jobs.
            worker = Worker(options.program, data, *LEASE)
            again = service.wait_for(service.must("POST", "/v1/models", study.model_request(subject))["job"])
            worker.end(signal.SIGTERM)
            assert again["state"] == "succeeded", again
            assert service.alive()
            print(json.dumps({"error": ended["error"]}))
        finally:
            service.end()


if __name__ == "__main__":
    main()
