"""Damaged and odd files: those of a folder, and mutations of good ones. Each is answered 201 or a 4xx that says what to do; the
service neither dies nor answers 5xx, and a refused upload leaves nothing."""
import gzip
import io
import json
import pathlib
import random
import struct
import sys
import tarfile
import tempfile
import zipfile

from service import Service, Study, arguments, files_under

TAKEN = (".nii", ".nii.gz", ".nrrd", ".mha", ".zip", ".tar", ".tar.gz")


def nrrd(data):
    return (b"NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: 8 8 8\nspace: left-posterior-superior\n"
            b"space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n" + data)


def mha(data):
    return (b"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = 8 8 8\n"
            b"ElementSpacing = 1 1 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + data)


def nifti(data, **fields):
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, *fields.get("dim", (3, 8, 8, 8, 1, 1, 1, 1)))
    struct.pack_into("<hh", header, 70, fields.get("datatype", 2), fields.get("bitpix", 8))
    struct.pack_into("<8f", header, 76, *fields.get("pixdim", (1, 1, 1, 1, 1, 1, 1, 1)))
    struct.pack_into("<f", header, 108, 352)
    struct.pack_into("<h", header, 254, 1)
    for row in range(3):
        struct.pack_into("<4f", header, 280 + 16 * row, *fields.get("affine", ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))[row])
    header[344:348] = fields.get("magic", b"n+1\0")
    return bytes(header) + data


def absurd():
    """Headers that no scanner writes; each is refused."""
    data, nan, inf = bytes(range(256)) * 2, float("nan"), float("inf")
    flat = ((1, 0, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0))
    yield "magic", "a.nii", nifti(data, magic=b"nope")
    yield "negative size", "a.nii", nifti(data, dim=(3, -8, 8, 8, 1, 1, 1, 1))
    yield "zero size", "a.nii", nifti(data, dim=(3, 8, 0, 8, 1, 1, 1, 1))
    yield "overflowing size", "a.nii", nifti(data, dim=(3, 32767, 32767, 32767, 1, 1, 1, 1))
    yield "zero spacing", "a.nii", nifti(data, pixdim=(1, 0, 1, 1, 1, 1, 1, 1), affine=((0, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))
    yield "NaN spacing", "a.nii", nifti(data, pixdim=(1, nan, 1, 1, 1, 1, 1, 1), affine=((nan, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))
    yield "the same everywhere", "a.nii", nifti(bytes([7]) * 512)
    yield "spacing in metres", "a.nii", nifti(data, pixdim=(1, 1e-4, 1e-4, 1e-4, 1, 1, 1, 1), affine=((1e-4, 0, 0, 0), (0, 1e-4, 0, 0), (0, 0, 1e-4, 0)))
    yield "spacing of a house", "a.nii", nifti(data, pixdim=(1, 500, 1, 1, 1, 1, 1, 1), affine=((500, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))
    yield "infinite origin", "a.nii", nifti(data, affine=((1, 0, 0, inf), (0, 1, 0, 0), (0, 0, 1, 0)))
    yield "singular direction", "a.nii", nifti(data, affine=flat)
    yield "2-D", "a.nii", nifti(data, dim=(2, 16, 32, 1, 1, 1, 1, 1))
    yield "4-D", "a.nii", nifti(data, dim=(4, 8, 8, 4, 2, 1, 1, 1))
    yield "vector", "a.nii", nifti(data, dim=(5, 8, 8, 2, 1, 4, 1, 1))
    yield "RGB", "a.nii", nifti(data * 3, datatype=128, bitpix=24)
    yield "truncated", "a.nii", nifti(data[:-1])
    yield "truncated gzip", "a.nii.gz", gzip.compress(nifti(data))[:-9]
    yield "half a header", "a.nii", nifti(data)[:100]
    yield "vector NRRD", "a.nrrd", nrrd(data).replace(b"dimension: 3\nsizes: 8 8 8", b"dimension: 4\nsizes: 2 8 8 4")
    yield "NaN in NRRD", "a.nrrd", nrrd(data).replace(b"(1,0,0)", b"(nan,0,0)")
    yield "singular NRRD", "a.nrrd", nrrd(data).replace(b"(0,1,0)", b"(1,0,0)")
    yield "data elsewhere", "a.nrrd", nrrd(b"").replace(b"encoding", b"data file: ../../lock\nencoding")
    yield "data elsewhere in MHA", "a.mha", mha(b"").replace(b"LOCAL", b"/etc/passwd")
    yield "2-D MHA", "a.mha", mha(data).replace(b"NDims = 3", b"NDims = 2").replace(b"8 8 8", b"16 32").replace(b"1 1 1", b"1 1")
    yield "zero spacing MHA", "a.mha", mha(data).replace(b"Spacing = 1 1", b"Spacing = 0 1")
    yield "not an archive", "a.zip", data
    yield "empty archive", "a.zip", zipped({})
    yield "climbing archive", "a.zip", zipped({"../../evil.dcm": data})
    yield "absolute path", "a.tar", tarred("/tmp/evil.dcm", data)
    yield "link", "a.tar", tarred("link.dcm", b"", tarfile.SYMTYPE)
    yield "device", "a.tar", tarred("device.dcm", b"", tarfile.CHRTYPE)
    yield "bomb", "a.zip", zipped({"bomb.dcm": bytes(80 << 20)})
    yield "no DICOM", "a.zip", zipped({"readme.txt": data})


def zipped(files):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


def tarred(name, data, kind=tarfile.REGTYPE):
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w") as archive:
        info = tarfile.TarInfo(name)
        info.type, info.size, info.linkname = kind, len(data), "/etc/passwd"
        archive.addfile(info, io.BytesIO(data))
    return out.getvalue()


def mutated(dice, data):
    data = bytearray(data)
    for _ in range(dice.choice((1, 1, 2, 8, 64))):
        at = min(int(dice.expovariate(1 / 200)), len(data) - 1) if dice.random() < 0.7 else dice.randrange(len(data))
        what = dice.random()
        if what < 0.5:
            data[at] = dice.randrange(256)
        elif what < 0.7:
            data[at:at + 4] = dice.choice((b"\xff\xff\xff\xff", b"\0\0\0\0", b"\0\0\x80\x7f", b"\xff\xff\xff\x7f"))
        elif what < 0.85:
            del data[at:at + dice.randrange(1, 64)]
        else:
            data[at:at] = data[:dice.randrange(64)]
        if not data:
            data = bytearray(b"\0")
    return bytes(data[:dice.randrange(1, len(data) + 1)] if dice.random() < 0.1 else data)


def seeds(study, shared):
    good = bytes(range(256)) * 2
    found = [("a.nii", nifti(good)), ("a.nii.gz", gzip.compress(nifti(good))), ("a.nrrd", nrrd(good)), ("a.mha", mha(good))]
    found.append(("a.nii.gz", study.scans()[0][1]))
    for folder in sorted(shared.glob("dicom-*"))[:4] if shared else []:
        slices = sorted(p for p in folder.rglob("*.dcm") if p.stat().st_size < 200_000)[:4]
        if slices:
            found.append(("a.zip", zipped({p.name: p.read_bytes() for p in slices})))
    return found


class Uploads:
    def __init__(self, service, data):
        self.service, self.data, self.number = service, data, 0
        self.counts = {}
        self.subject = service.must("POST", "/v1/subjects", {"region": "custom"})["id"]

    def send(self, what, filename, body):
        self.number += 1
        path = f"/v1/subjects/{self.subject}/scans?name=s{self.number}&filename={filename}"
        status, answer, headers = self.service.ask("POST", path, body)
        self.counts[status] = self.counts.get(status, 0) + 1
        assert status == 201 or 400 <= status < 500, (what, status, answer)
        if status >= 400:
            assert headers["Content-Type"] == "application/problem+json" and len(answer["detail"]) > 20, (what, answer)
            assert "/" not in answer["detail"] or "http" not in answer["detail"], (what, answer)
        return status, answer


def main():
    options = arguments(__doc__, shared="", mutations=40)
    study, dice = Study(options.study), random.Random(options.seed)
    shared = pathlib.Path(options.shared) if options.shared else None
    with tempfile.TemporaryDirectory() as data:
        service = Service(options.program, data, "--log", "off", "--workers", "0")
        try:
            uploads = Uploads(service, data)
            before = files_under(data + "/blobs")
            for what, filename, body in absurd():
                status, answer = uploads.send(what, filename, body)
                assert status != 201, f"{what} was accepted: {answer}"
            assert files_under(data + "/blobs") == before, "a refused upload was kept"
            for path in sorted((shared / "malformed-volumes").rglob("*")) if shared else []:
                if path.is_file() and path.name.endswith(TAKEN):
                    uploads.send(str(path.name), path.name[-40:].replace(" ", "_"), path.read_bytes())
            good = seeds(study, shared)
            for number in range(int(options.mutations)):
                filename, body = dice.choice(good)
                uploads.send(f"mutation {number} of seed {options.seed}", filename, mutated(dice, body))
            assert not files_under(data + "/incoming"), "half an upload is still there"
            assert service.alive() and service.must("GET", "/healthz")["status"] == "ok"
            print(json.dumps({"uploads": uploads.number, "answers": uploads.counts, "service_peak_mib": round(service.resident_mib())}))
        finally:
            service.end()


if __name__ == "__main__":
    sys.exit(main())
