"""A foreign client, tus-js-client under node, uploads in parts, aborts, resumes; a whole that does not match its digest is refused."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

from service import Service, Study, arguments, sha256

FOREIGN = pathlib.Path(__file__).resolve().parent.parent / "foreign"


def main():
    options = arguments(__doc__)
    if not shutil.which("node") or not (FOREIGN / "node_modules" / "tus-js-client").is_dir():
        print("SKIPPED: node or tus-js-client is not installed; run ./do setup")
        return 77
    study = Study(options.study)
    name, data = study.scans()[0]
    with tempfile.TemporaryDirectory() as scratch:
        service = Service(options.program, scratch + "/data", "--workers", "0", "--log", "error")
        try:
            path = pathlib.Path(scratch, name + ".nii.gz")
            path.write_bytes(data)
            subject = service.must("POST", "/v1/subjects", {"region": study.json["region"]})["id"]
            metadata = {"subject": subject, "name": name, "filename": path.name, "sha256": sha256(data)}
            words = ["node", str(FOREIGN / "tus_upload.mjs"), f"http://127.0.0.1:{service.port}/v1/uploads", str(path),
                     str(len(data) // 7), json.dumps(metadata)]
            done = subprocess.run(words, capture_output=True, text=True, timeout=120)
            assert done.returncode == 0, done.stderr
            answer = json.loads(done.stdout)
            assert len(data) / 2 <= answer["reached"] < len(data), answer
            assert answer["refused"] == "400", answer
            record = service.must("GET", "/v1/uploads/" + answer["url"].rsplit("/", 1)[1])
            assert service.must("GET", record["location"])["sha256"] == sha256(data)
            names = {scan["name"] for scan in service.must("GET", f"/v1/subjects/{subject}/scans")["items"]}
            assert names == {name, "at-once"}, names
            print(json.dumps({"resumed_at": answer["reached"], "bytes": len(data)}))
            return 0
        finally:
            service.end()


if __name__ == "__main__":
    sys.exit(main())
