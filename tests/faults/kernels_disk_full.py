"""The disk of PoCL's folder fills up under a service, which PoCL would end: the service is not ready and begins no job, and goes
on when there is room again."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import small_disk
from service import Service, Study
from small_disk import MIB, fill, mount


def build(service, study, subject):
    return service.must("POST", "/v1/models", study.model_request(subject))["job"]


def inside(options):
    study = Study(options.study)
    with tempfile.TemporaryDirectory() as scratch:
        kernels = pathlib.Path(scratch, "kernels")
        mount(kernels)
        os.environ.update(POCL_CACHE_DIR=str(kernels / "pocl"), KVX_KERNEL_CACHE=str(kernels / "kinevox"))
        service = Service(options.program, pathlib.Path(scratch, "data"), "--log", "error")
        try:
            subject = study.send(service)
            assert service.wait_for(build(service, study, subject))["state"] == "succeeded"
            if not any(path.is_file() for path in (kernels / "pocl").rglob("*.so")):
                print("SKIPPED: the device is not PoCL's")
                return 77
            fill(kernels, MIB)
            status, problem, _ = service.ask("GET", "/readyz")
            assert status == 503 and "POCL_CACHE_DIR" in json.dumps(problem), (status, problem)
            job = build(service, study, study.send(service))
            time.sleep(2)
            assert service.must("GET", f"/v1/jobs/{job}")["state"] == "queued"
            (kernels / "ballast").unlink()
            assert service.wait_for(job)["state"] == "succeeded"
            assert service.ask("GET", "/readyz")[0] == 200
            fill(kernels, MIB)
            service.end()
            refused = subprocess.run([options.program, "serve", "--data", scratch + "/data"], capture_output=True, text=True)
            assert refused.returncode == 4 and "nearly full" in refused.stderr, refused
        finally:
            service.end()
            subprocess.check_call(["umount", "--lazy", str(kernels)])
    print(json.dumps({"refused": refused.stderr}))


if __name__ == "__main__":
    sys.exit(small_disk.run(__doc__, inside))
