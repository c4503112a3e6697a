"""A large volume is streamed: the service's peak of resident memory stays under --most MiB and rises by less
than 150, whatever its size."""
import hashlib
import http.client
import json
import tempfile

from bad_uploads import nifti
from service import Service, arguments

MIB = 1 << 20


def main():
    options = arguments(__doc__, mib="2048", most="300")
    mib = int(options.mib)
    header = nifti(b"", dim=(3, 1024, 1024, mib, 1, 1, 1, 1))[:352]
    with tempfile.TemporaryDirectory() as data:
        service = Service(options.program, data, "--log", "error", "--workers", "0")
        try:
            subject = service.must("POST", "/v1/subjects", {"region": "custom"})["id"]
            before, digest = service.resident_mib(), hashlib.sha256(header)
            connection = http.client.HTTPConnection("127.0.0.1", service.port, timeout=600)
            connection.putrequest("POST", f"/v1/subjects/{subject}/scans?name=large&filename=large.nii")
            connection.putheader("Content-Length", str(len(header) + mib * MIB))
            connection.endheaders(header)
            for number in range(mib):
                block = number.to_bytes(4, "little") * (MIB // 4)
                digest.update(block)
                connection.send(block)
            answer = connection.getresponse()
            body = json.loads(answer.read())
            peak = service.resident_mib()
            if mib <= 512:  # 2^29 voxels are the most that is taken
                assert answer.status == 201 and body["sha256"] == digest.hexdigest(), body
            else:
                assert answer.status == 400 and "voxels" in body["detail"], body
            assert peak < int(options.most), f"the service took {peak:.0f} MiB"
            assert peak - before < 150, f"the service took {peak - before:.0f} MiB more"
            print(json.dumps({"uploaded_mib": mib, "status": answer.status, "before_mib": round(before), "peak_mib": round(peak)}))
        finally:
            service.end()


if __name__ == "__main__":
    main()
