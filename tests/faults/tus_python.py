"""A foreign client, python3-tuspy, uploads in parts with checksums, breaks off, resumes, and ends with a scan of the same bytes."""
import json
import sys
import tempfile

from service import Service, Study, arguments, sha256

try:
    from tusclient import client as tus
    from tusclient.storage import filestorage
except ImportError:
    print("SKIPPED: python3-tuspy is not installed; run ./do setup")
    sys.exit(77)


def main():
    options = arguments(__doc__)
    study = Study(options.study)
    name, data = study.scans()[0]
    with tempfile.TemporaryDirectory() as scratch:
        service = Service(options.program, scratch + "/data", "--workers", "0", "--log", "error")
        try:
            path = f"{scratch}/{name}.nii.gz"
            with open(path, "wb") as file:
                file.write(data)
            subject = service.must("POST", "/v1/subjects", {"region": study.json["region"]})["id"]
            metadata = {"subject": subject, "name": name, "filename": name + ".nii.gz", "sha256": sha256(data)}
            settings = dict(chunk_size=len(data) // 5, metadata=metadata, upload_checksum=True, store_url=True,
                            url_storage=filestorage.FileStorage(scratch + "/urls.json"))
            address = f"http://127.0.0.1:{service.port}/v1/uploads"
            first = tus.TusClient(address).uploader(path, **settings)
            first.upload(stop_at=len(data) // 2)
            reached = first.offset
            assert 0 < reached < len(data), reached
            upload = first.url.rsplit("/", 1)[1]
            service.end()  # kill -9 in the middle
            service = Service(options.program, scratch + "/data", "--workers", "0", "--log", "error")
            moved = f"http://127.0.0.1:{service.port}/v1/uploads/{upload}"
            second = tus.TusClient(address).uploader(path, url=moved, chunk_size=len(data) // 5, upload_checksum=True)
            assert second.offset == reached, (second.offset, reached)
            second.upload()
            record = service.must("GET", f"/v1/uploads/{upload}")
            assert record["state"] == "finished" and record["offset"] == len(data), record
            scan = service.must("GET", record["location"])
            assert scan["sha256"] == sha256(data) and scan["name"] == name, scan
            print(json.dumps({"resumed_at": reached, "bytes": len(data)}))
        finally:
            service.end()


if __name__ == "__main__":
    main()
