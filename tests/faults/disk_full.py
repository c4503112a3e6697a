"""A disk that fills up at every write: a small tmpfs in a mount namespace of our own, filled to a little less each round. Every
answer is one of ours, never a 500; what was accepted is there afterwards, and the service goes on when there is room again."""
import gzip
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import small_disk
from service import Service, Study
from small_disk import fill, mount

FULL = (503, 507)
OURS = (200, 201, 202, 204) + FULL


def main_job(service, study):
    """As far as it comes; returns the job, and what was accepted."""
    accepted, subject = [], None
    status, data, _ = service.ask("POST", "/v1/subjects", {"region": study.json["region"]})
    assert status in OURS, (status, data)
    if status in FULL:
        return None, accepted
    subject = data["id"]
    accepted.append(f"/v1/subjects/{subject}")
    for name, body in study.scans():
        status, data, _ = service.ask("POST", f"/v1/subjects/{subject}/scans?name={name}&filename={name}.nii.gz", body)
        assert status in OURS, (status, data)
        if status in FULL:
            assert "disk" in data["detail"], data
            return None, accepted
        accepted.append(f"/v1/subjects/{subject}/scans/{data['id']}")
    status, data, _ = service.ask("POST", f"/v1/subjects/{subject}/bones?template={study.json['template']}", study.bones())
    assert status in OURS, (status, data)
    if status in FULL:
        return None, accepted
    status, data, _ = service.ask("POST", "/v1/models", study.model_request(subject))
    assert status in OURS, (status, data)
    return (data["job"] if status == 202 else None), accepted


def posed_whole_or_not_at_all(service, model, folder, leave):
    """What is posed while the disk is full is whole or 503, and nothing of it is served as the result afterwards."""
    address = f"/v1/models/{model}/volume?" + "&".join(f"{m}=7" for m in motions_of(service, model)) + "&format="
    fill(folder, leave)
    full = {format: service.ask("GET", address + format) for format in ("nii", "nii.gz")}
    (folder / "ballast").unlink()
    whole = service.must("GET", address + "nii")
    assert len(whole) > 352
    for format, (status, data, _) in full.items():
        assert status in (200, 503), (status, data)
        assert status in FULL or (data if format == "nii" else gzip.decompress(data)) == whole, (format, len(data), len(whole))
    assert gzip.decompress(service.must("GET", address + "nii.gz")) == whole


def motions_of(service, model):
    joints = service.must("GET", f"/v1/models/{model}")["joints"]
    return [f"{joint['child']}.{dof['name']}" for joint in joints for dof in joint["dofs"]]


def one_round(program, study, folder, leave):
    service = Service(program, folder / "data", "--log", "error", "--set", "limits.least_free_gib=0")
    try:
        fill(folder, leave)
        job, accepted = main_job(service, study)
        time.sleep(0.3 if job else 0)
        (folder / "ballast").unlink()
        for address in accepted:
            service.must("GET", address)
        fresh, _ = main_job(service, study)  # there is room again
        ends = [service.wait_for(each)["state"] for each in (job, fresh) if each]
        assert fresh and ends[-1] == "succeeded", ends
        assert ends[0] in ("succeeded", "failed"), ends
        posed_whole_or_not_at_all(service, service.must("GET", f"/v1/jobs/{fresh}")["model"], folder, leave)
        assert not list((folder / "data" / "incoming").iterdir()), "half an upload is still there"
        assert service.alive()
    finally:
        service.end()
    service = Service(program, folder / "data", "--log", "error", "--set", "limits.least_free_gib=0")  # readable afterwards
    try:
        for address in accepted:
            service.must("GET", address)
    finally:
        service.end()
    return ends


def inside(options):
    study = Study(options.study)
    outcomes = []
    with tempfile.TemporaryDirectory() as scratch:
        for number in range(options.rounds):
            folder = pathlib.Path(scratch, str(number))
            mount(folder)
            leave = int(4096 * 1.9 ** (number * 16 / max(1, options.rounds)))  # 4 KiB to tens of MiB
            outcomes.append([leave, *one_round(options.program, study, folder, leave)])
            subprocess.check_call(["umount", str(folder)])
    print(json.dumps({"left_bytes_and_ends": outcomes}))


if __name__ == "__main__":
    sys.exit(small_disk.run(__doc__, inside))
