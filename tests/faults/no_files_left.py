"""A disk with all its bytes free, but no room for more files: the service is not ready, begins no job and takes nothing new, and goes
on when there is room again."""
import json
import pathlib
import subprocess
import sys
import tempfile

import small_disk
from service import Service, Study


def inside(options):
    study = Study(options.study)
    with tempfile.TemporaryDirectory() as scratch:
        disk = pathlib.Path(scratch, "disk")
        disk.mkdir()
        subprocess.check_call(["mount", "-t", "tmpfs", "-o", "size=256m,nr_inodes=2000", "none", str(disk)])
        service = Service(options.program, disk / "data", "--log", "error", "--set", "limits.least_free_gib=0")
        try:
            request = study.model_request(study.send(service))
            ballast = disk / "ballast"
            ballast.mkdir()
            for number in range(1500):
                (ballast / str(number)).touch()
            status, problem, _ = service.ask("GET", "/readyz")
            assert status == 503 and "nearly full" in problem["detail"], (status, problem)
            status, problem, _ = service.ask("POST", "/v1/models", request)
            assert status == 507, (status, problem)
            for file in ballast.iterdir():
                file.unlink()
            jobs = [service.must("POST", "/v1/models", request)["job"] for _ in range(2)]
            assert [service.wait_for(job)["state"] for job in jobs] == ["succeeded"] * 2
            assert service.ask("GET", "/readyz")[0] == 200
        finally:
            service.end()
            subprocess.check_call(["umount", "--lazy", str(disk)])
    print(json.dumps({"built": len(jobs)}))


if __name__ == "__main__":
    sys.exit(small_disk.run(__doc__, inside))
