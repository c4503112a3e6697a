"""What the fault tests share: the program's processes, requests without retries, a study's files. Standard library only."""
import argparse
import hashlib
import http.client
import json
import os
import pathlib
import signal
import subprocess
import tempfile
import time


class Service:
    """`kinevox serve` on a free port of 127.0.0.1; killed with the object."""

    def __init__(self, program, data, *options, wrap=()):
        self.out = tempfile.TemporaryFile()
        self.err = tempfile.TemporaryFile()
        words = [*wrap, str(program), "serve", "--data", str(data), "--listen", "127.0.0.1:0", "--json", *options]
        self.process = subprocess.Popen(words, stdout=self.out, stderr=self.err)
        self.port = self._port()

    def _port(self):
        while self.process.poll() is None:
            self.out.seek(0)
            text = self.out.read()
            if text.endswith(b"\n"):
                return json.loads(text)["port"]
            time.sleep(0.01)
        raise RuntimeError("the service ended at once: " + self.log())

    def log(self):
        self.err.seek(0)
        return self.err.read().decode(errors="replace")

    def alive(self):
        return self.process.poll() is None

    def resident_mib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmHWM:")[1].split()[0]) / 1024

    def end(self, how=signal.SIGKILL):
        if self.alive():
            self.process.send_signal(how)
        return self.process.wait()

    def ask(self, method, path, body=b"", headers=None, timeout=120):
        """(status, parsed body or bytes, headers); raises OSError or HTTPException when no answer comes."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        try:
            if isinstance(body, (dict, list)):
                body = json.dumps(body).encode()
            connection.request(method, path, body=body, headers=headers or {})
            answer = connection.getresponse()
            data = answer.read()
            if "json" in (answer.getheader("Content-Type") or ""):
                data = json.loads(data)
            return answer.status, data, answer.headers
        finally:
            connection.close()

    def must(self, method, path, body=b"", headers=None):
        status, data, _ = self.ask(method, path, body, headers)
        if status >= 300:
            raise AssertionError(f"{method} {path}: {status} {data}")
        return data

    def wait_for(self, job, seconds=300):
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            state = self.must("GET", f"/v1/jobs/{job}?wait=5")
            if state["state"] not in ("queued", "running"):
                return state
        raise AssertionError("the job does not end")


class Worker:
    """`kinevox worker` on a data folder."""

    def __init__(self, program, data, *options):
        self.err = tempfile.TemporaryFile()
        self.process = subprocess.Popen([str(program), "worker", "--data", str(data), *options], stderr=self.err)

    def alive(self):
        return self.process.poll() is None

    def log(self):
        self.err.seek(0)
        return self.err.read().decode(errors="replace")

    def end(self, how=signal.SIGKILL):
        if self.alive():
            self.process.send_signal(how)
        return self.process.wait()


NO_ANSWER = (OSError, http.client.HTTPException)


class Study:
    """The files that a study.json names."""

    def __init__(self, path):
        self.folder = pathlib.Path(path).parent
        self.json = json.loads(pathlib.Path(path).read_text())

    def scans(self):
        return [(scan["name"], (self.folder / scan["volume"]).read_bytes()) for scan in self.json["scans"]]

    def bones(self):
        return (self.folder / self.json["bones"]["labels"]).read_bytes()

    def model_request(self, subject):
        return {"subject": subject, "template": self.json["template"], "bones": self.json["bones"]["list"],
                "joints": self.json.get("joints")}

    def send(self, service, region=None):
        subject = service.must("POST", "/v1/subjects", {"region": region or self.json["region"]})["id"]
        for name, data in self.scans():
            service.must("POST", f"/v1/subjects/{subject}/scans?name={name}&filename={name}.nii.gz", data)
        service.must("POST", f"/v1/subjects/{subject}/bones?template={self.json['template']}", self.bones())
        return subject


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def arguments(description, **more):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--program", required=True)
    parser.add_argument("--study", required=True)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    for name, default in more.items():
        parser.add_argument("--" + name, default=default)
    return parser.parse_args()


def files_under(folder):
    return sorted(str(p.relative_to(folder)) for p in pathlib.Path(folder).rglob("*") if p.is_file())
