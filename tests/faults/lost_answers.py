"""`kinevox cancel` and `kinevox jobs` over a proxy that loses answers: each job is cancelled, and told."""
import json
import pathlib
import subprocess
import tempfile

from meddler import Meddler
from service import Service, Study, arguments


def main():
    options = arguments(__doc__)
    study = Study(options.study)
    with tempfile.TemporaryDirectory() as folder:
        service = Service(options.program, pathlib.Path(folder, "data"), "--workers", "0", "--log", "error")
        try:
            request = study.model_request(study.send(service))
            jobs = [service.must("POST", "/v1/models", request)["job"] for _ in range(4)]
            losing = Meddler(service.port, lambda n, *_: "lose the answer" if n in (2, 7) else None)
            run = lambda *words: json.loads(subprocess.run([options.program, *words, "--server", losing.url, "--json"], timeout=60,
                                                           check=True, stdout=subprocess.PIPE).stdout)
            told = run("cancel", *jobs)
            assert [one["state"] for one in told] == ["cancelled"] * 4, told
            assert len(losing.asked) > 4, "no answer was lost"
            listed = run("jobs")["items"]
            assert sorted(one["id"] for one in listed) == sorted(jobs), listed
            print(f"{len(jobs)} jobs cancelled and listed with {len(losing.asked)} requests")
        finally:
            service.end()


if __name__ == "__main__":
    main()
