"""Ctrl-C in the middle of a file that `kinevox submit` sends: the same command goes on, and no byte goes over the line twice
but what was lost on it."""
import gzip
import json
import pathlib
import signal
import subprocess
import tempfile

from line import Line, start
from service import Service, Study, arguments


class CountingLine(Line):
    """Once it has carried `most` bytes there it calls `full`, and breaks."""

    def __init__(self, port, most=None, full=None):
        self.most, self.full, self.carried = most, full, 0
        super().__init__(port)

    def join(self, client, server):
        start(self.carry, client, server, 4096, self.count)
        start(self.carry, server, client, 4096, lambda _: False)

    def count(self, there):
        self.carried += there
        full = self.most is not None and self.carried >= self.most
        if full:
            self.full()
        return full


def plain_study(path, folder):
    """The study with its scans unpacked, and the size of the first."""
    study = Study(path)
    study.json["bones"]["labels"] = "bones.nii.gz"
    pathlib.Path(folder, "bones.nii.gz").write_bytes(study.bones())
    for scan, (name, data) in zip(study.json["scans"], study.scans()):
        scan["volume"] = name + ".nii"
        pathlib.Path(folder, scan["volume"]).write_bytes(gzip.decompress(data))
    file = pathlib.Path(folder, "study.json")
    file.write_text(json.dumps(study.json))
    return str(file), pathlib.Path(folder, study.json["scans"][0]["volume"]).stat().st_size


def main():
    options = arguments(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        path, size = plain_study(options.study, folder)
        service = Service(options.program, pathlib.Path(folder, "data"), "--workers", "0", "--log", "error")
        submit = lambda line: subprocess.Popen([options.program, "submit", path, "--server", line.url, "--quiet", "--json"],
                                               stdout=subprocess.PIPE)
        try:
            first = CountingLine(service.port, size * 3 // 4, lambda: command.send_signal(signal.SIGINT))
            command = submit(first)
            assert command.wait(60) == 130, "it was not interrupted"
            rest = CountingLine(service.port)
            command = submit(rest)
            answer = json.loads(command.communicate(timeout=60)[0])
            assert command.returncode == 0 and answer["state"] == "queued", answer
            files = sum(file.stat().st_size for file in pathlib.Path(folder).glob("*.nii*"))
            print(f"{files} bytes of files: {first.carried} bytes before the interruption, {rest.carried} after it")
            assert rest.carried < files - size // 2, "what had come was sent again"
        finally:
            service.end()


if __name__ == "__main__":
    main()
