"""kill -9 at random moments of a segmentation from strokes, then restart: the job ends, with the label map of an undisturbed run, and
what the killed runs left behind is gone."""
import gzip
import pathlib
import random
import tempfile
import time

from service import Service, Study, arguments, files_under, sha256

HEADER = 352  # bytes of an uncompressed NIfTI-1 file before its voxels
BACKGROUND = 255


def strokes_of(label_map):
    """Every third voxel of the bones and every 17th around them."""
    data = bytearray(gzip.decompress(label_map))
    for i in range(HEADER, len(data)):
        if data[i] == 0:
            data[i] = BACKGROUND if i % 17 == 0 else 0
        elif i % 3 != 0:
            data[i] = 0
    return gzip.compress(bytes(data))


def send(service, study, strokes):
    subject = service.must("POST", "/v1/subjects", {"region": "knee"})["id"]
    name, scan = study.scans()[0]
    service.must("POST", f"/v1/subjects/{subject}/scans?name={name}&filename={name}.nii.gz", scan)
    made = service.must("POST", f"/v1/subjects/{subject}/bones?template={name}&kind=seeds", strokes)
    return f"/v1/subjects/{subject}/bones/{made['id']}/volume?format=nii", made["job"]


def undisturbed(program, study, strokes, folder):
    service = Service(program, folder, "--log", "error")
    try:
        begin = time.monotonic()
        volume, job = send(service, study, strokes)
        ended = service.wait_for(job)
        assert ended["state"] == "succeeded", ended
        return sha256(service.must("GET", volume)), time.monotonic() - begin
    finally:
        service.end()


def main():
    options = arguments(__doc__)
    rng = random.Random(options.seed)
    study = Study(options.study)
    strokes = strokes_of(study.bones())
    with tempfile.TemporaryDirectory() as folder:
        expected, seconds = undisturbed(options.program, study, strokes, pathlib.Path(folder, "undisturbed"))
        attempts = []
        for i in range(options.rounds):
            data = pathlib.Path(folder, str(i))
            service = Service(options.program, data, "--log", "error")
            volume, job = send(service, study, strokes)
            time.sleep(rng.uniform(0, seconds))
            service.end()
            service = Service(options.program, data, "--log", "error")
            try:
                ended = service.wait_for(job)
                assert ended["state"] == "succeeded", ended
                assert sha256(service.must("GET", volume)) == expected, "the label map differs from an undisturbed run's"
                attempts.append(ended["attempt"])
                left = [file for name in ("incoming", "work") for file in files_under(data / name)]
                assert not left, f"left behind: {len(left)} files"
            finally:
                service.end()
        print(f"{options.rounds} kills within {seconds:.1f} s; attempts {attempts}")


if __name__ == "__main__":
    main()
