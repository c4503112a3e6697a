"""kill -9 at random moments over upload, queue, every stage and finish, then restart. What was answered 2xx is there after the
restart, every accepted job ends once, and its digest is that of an undisturbed run."""
import json
import pathlib
import random
import sqlite3
import tempfile
import threading
import time

from service import NO_ANSWER, Service, Study, arguments, sha256

OPTIONS = ("--log", "error")


class Client:
    """Does the main job over and over, and remembers every promise that it was given."""

    def __init__(self, service, study, accepted):
        self.service, self.study, self.accepted = service, study, accepted
        self.stop = False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        try:
            while not self.stop:
                self.one()
        except NO_ANSWER:
            pass  # the service was killed

    def one(self):
        subject = self.service.must("POST", "/v1/subjects", {"region": self.study.json["region"]})["id"]
        self.accepted["subjects"].append(subject)
        for name, data in self.study.scans():
            scan = self.service.must("POST", f"/v1/subjects/{subject}/scans?name={name}&filename={name}.nii.gz", data)
            self.accepted["scans"].append((subject, scan["id"], sha256(data)))
        self.service.must("POST", f"/v1/subjects/{subject}/bones?template={self.study.json['template']}", self.study.bones())
        model = self.service.must("POST", "/v1/models", self.study.model_request(subject))
        self.accepted["jobs"].append((model["job"], model["id"]))
        self.service.wait_for(model["job"])


def undisturbed(program, study, folder):
    service = Service(program, folder, *OPTIONS)
    try:
        subject = study.send(service)
        begin = time.monotonic()
        job = service.wait_for(service.must("POST", "/v1/models", study.model_request(subject))["job"])
        assert job["state"] == "succeeded", job
        return job["result"]["digest"], time.monotonic() - begin
    finally:
        service.end()


def check_promises(service, accepted):
    for subject in accepted["subjects"]:
        service.must("GET", f"/v1/subjects/{subject}")
    for subject, scan, digest in accepted["scans"]:
        record = service.must("GET", f"/v1/subjects/{subject}/scans/{scan}")
        assert record["sha256"] == digest, f"the scan {scan} has changed"


def check_blobs(data, accepted):
    """Every promised scan's bytes are there, and are the bytes."""
    database = sqlite3.connect(f"file:{data}/kinevox.db?mode=ro", uri=True)
    for _, scan, digest in accepted["scans"]:
        (content,) = database.execute("SELECT content FROM scan WHERE id = ?", (scan,)).fetchone()
        blob = pathlib.Path(data, "blobs", content[:2], content)
        assert sha256(blob.read_bytes()) == digest, f"the bytes of scan {scan} are not there"
    database.close()


def check_jobs(service, accepted, digest):
    for job, model in accepted["jobs"]:
        ended = service.wait_for(job)
        assert ended["state"] == "succeeded", ended
        assert ended["result"]["digest"] == digest, "the digest differs from an undisturbed run's"
        assert service.must("GET", f"/v1/models/{model}")["digest"] == digest


def check_ends(data, accepted):
    database = sqlite3.connect(f"file:{data}/kinevox.db?mode=ro", uri=True)
    for job, _ in accepted["jobs"]:
        ends = database.execute("SELECT count(*) FROM job_event WHERE job = ? AND state = 'succeeded'", (job,)).fetchone()[0]
        assert ends == 1, f"the job {job} ended {ends} times"
    database.close()


def one_round(program, study, folder, delay, digest):
    accepted = {"subjects": [], "scans": [], "jobs": []}
    service = Service(program, folder, *OPTIONS)
    client = Client(service, study, accepted)
    time.sleep(delay)
    service.end()
    client.stop = True
    client.thread.join()
    service = Service(program, folder, *OPTIONS)
    try:
        check_promises(service, accepted)
        check_jobs(service, accepted, digest)
        leftovers = list(pathlib.Path(folder, "incoming").iterdir())
        assert not leftovers, "what was half received is still there"
    finally:
        service.end()
    check_blobs(folder, accepted)
    check_ends(folder, accepted)
    return len(accepted["scans"]), len(accepted["jobs"])


def main():
    options = arguments(__doc__)
    study, dice = Study(options.study), random.Random(options.seed)
    with tempfile.TemporaryDirectory() as scratch:
        digest, seconds = undisturbed(options.program, study, scratch + "/undisturbed")
        scans = jobs = 0
        for number in range(options.rounds):
            # Early moments hit uploads and the queue, late ones stages and the finish.
            delay = dice.uniform(0, 0.5) if dice.random() < 0.4 else dice.uniform(0, 1.4 * seconds + 1)
            got = one_round(options.program, study, f"{scratch}/{number}", delay, digest)
            scans, jobs = scans + got[0], jobs + got[1]
        print(json.dumps({"kills": options.rounds, "seed": options.seed, "accepted_scans": scans, "accepted_jobs": jobs}))


if __name__ == "__main__":
    main()
