"""A line that breaks three times between `kinevox fetch` and the service: the file comes whole, and no byte goes over the
line twice but what was lost on it. Then a proxy that loses answers, is busy, cuts files short, or tells no length."""
import json
import pathlib
import subprocess
import tempfile

from line import Line, start
from meddler import Meddler
from service import Service, Study, arguments


class BreakingLine(Line):
    """Cuts each of the first connections once it has carried so many bytes back."""

    def __init__(self, port, breaks, break_after):
        self.breaks, self.break_after, self.carried = breaks, break_after, []
        super().__init__(port)

    def join(self, client, server):
        self.carried.append(0)
        index, limited = len(self.carried) - 1, len(self.carried) <= self.breaks

        def count(back):
            self.carried[index] += back
            return limited and self.carried[index] >= self.break_after

        start(self.carry, client, server, 65536, lambda _: False)
        start(self.carry, server, client, 1024, count)


# What the proxy does with the first requests, one after the other, and the most that may come over it, in files.
MEDDLING = {
    "its first answer is lost": (["lose the answer"], 1),
    "busy at first": (["busy"], 1),
    "busy after it was cut": (["cut", "busy"], 1),
    "cut again and again": (["cut"] * 20, 1),
    "no length is told": (["chunked"], 1.01),
    "no length is told, and the end is cut": (["cut", "chunked"], 1.01),
}


def fetch(options, model, url, out, *pose):
    return subprocess.run([options.program, "fetch", model, "--server", url, "--out", str(out), "--quiet", *pose],
                          timeout=60, stderr=subprocess.PIPE, text=True)


def break_the_line(options, service, model, scan, whole, out):
    break_after = len(whole) // 5
    line = BreakingLine(service.port, 3, break_after)
    fetch(options, model, line.url, out, "--scan", scan).check_returncode()
    assert out.read_bytes() == whole, "the file differs from what the service has"
    assert len(line.carried) == 4, line.carried
    assert sum(line.carried) < len(whole) + break_after, "what had come was sent again"
    print(f"{len(whole)} bytes over {len(line.carried)} connections: {line.carried}")


def meddle_with(options, service, model, pose, whole, out):
    for tale, (deeds, most) in MEDDLING.items():
        done = lambda n, *_: deeds[n - 1] if n <= len(deeds) else None
        proxy = Meddler(service.port, done, len(whole) // 4)
        ended = fetch(options, model, proxy.url, out, *pose)
        assert ended.returncode == 0, f"{tale}, {pose[0]}: {ended.returncode} {ended.stderr}"
        assert out.read_bytes() == whole, tale
        assert proxy.carried <= most * len(whole), f"{tale}: what had come was sent again: {proxy.asked}"


def main():
    options = arguments(__doc__)
    study = Study(options.study)
    with tempfile.TemporaryDirectory() as folder:
        service = Service(options.program, pathlib.Path(folder, "data"), "--log", "error")
        try:
            model = service.must("POST", "/v1/models", study.model_request(study.send(service)))
            assert service.wait_for(model["job"])["state"] == "succeeded"
            scan = study.scans()[1][0]
            whole = service.must("GET", f"/v1/models/{model['id']}/volume?format=nrrd&scan={scan}")
            out, pose = pathlib.Path(folder, "posed.nrrd"), pathlib.Path(folder, "pose.json")
            break_the_line(options, service, model["id"], scan, whole, out)
            meddle_with(options, service, model["id"], ["--scan", scan], whole, out)
            pose.write_text(json.dumps({"scan": scan}))
            meddle_with(options, service, model["id"], ["--pose", str(pose)], whole, out)
        finally:
            service.end()


if __name__ == "__main__":
    main()
