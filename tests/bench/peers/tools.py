"""One registration by one peer: tools.py TOOL JOB.json. The job says fixed, moving, out, mask and deformable_only.

Writes into `out`: warped.nii.gz (the tool's own), field.nii.gz (fixed to moving, LPS mm, on the fixed grid), cost.json.
Only the registration is timed, not the conversion of its result. Settings are the authors' advice for large
deformations, in the presets that a user would try first.
"""
import json
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent


def call(*command, cwd=None):
    done = subprocess.run([str(c) for c in command], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        raise RuntimeError(f"{command[0]} failed: {done.stdout[-800:]}")


def elastix_files(job):
    return [HERE / "elastix_bspline.txt"] if job["deformable_only"] else [HERE / "elastix_rigid.txt", HERE / "elastix_bspline.txt"]


class Elastix:
    def register(self, job, out):
        stages = [part for file in elastix_files(job) for part in ("-p", file)]
        mask = ["-fMask", job["mask"]] if job["mask"] else []
        call("elastix", "-f", job["fixed"], "-m", job["moving"], *mask, *stages, "-out", out)
        self.last = len(elastix_files(job)) - 1

    def convert(self, job, out):
        shutil.copy(out / f"result.{self.last}.nii.gz", out / "warped.nii.gz")
        call("transformix", "-def", "all", "-tp", out / f"TransformParameters.{self.last}.txt", "-out", out)
        shutil.copy(out / "deformationField.nii.gz", out / "field.nii.gz")


class ItkElastix:
    def register(self, job, out):
        import itk
        self.itk = itk
        fixed, moving = (itk.imread(job[name], itk.F) for name in ("fixed", "moving"))
        parameters = itk.ParameterObject.New()
        for file in elastix_files(job):
            parameters.AddParameterFile(str(file))
        options = {"fixed_mask": itk.imread(job["mask"], itk.UC)} if job["mask"] else {}
        self.warped, self.transform = itk.elastix_registration_method(fixed, moving, parameter_object=parameters, **options)
        self.moving = moving

    def convert(self, job, out):
        self.itk.imwrite(self.warped, str(out / "warped.nii.gz"))
        self.itk.imwrite(self.itk.transformix_deformation_field(self.moving, self.transform), str(out / "field.nii.gz"))


class Plastimatch:
    def register(self, job, out):
        lines = ["[GLOBAL]", f"fixed={job['fixed']}", f"moving={job['moving']}", f"img_out={out / 'warped.nii.gz'}",
                 f"vf_out={out / 'vf.mha'}", "default_value=0"]
        if job["mask"]:
            lines.append(f"fixed_roi={job['mask']}")
        if not job["deformable_only"]:
            lines += ["[STAGE]", "xform=align_center", "[STAGE]", "xform=rigid", "optim=versor", "max_its=60", "res=4 4 2"]
        for spacing, res in ((40, "4 4 2"), (20, "2 2 1"), (10, "1 1 1")):
            lines += ["[STAGE]", "xform=bspline", "optim=lbfgsb", "impl=plastimatch", "metric=mse", "max_its=60",
                      f"grid_spac={spacing} {spacing} {spacing}", f"res={res}", "regularization_lambda=0.02"]
        (out / "command.txt").write_text("\n".join(lines) + "\n")
        call("plastimatch", "register", out / "command.txt")

    def convert(self, job, out):
        import SimpleITK as sitk
        sitk.WriteImage(sitk.ReadImage(str(out / "vf.mha")), str(out / "field.nii.gz"))


class Ants:
    def register(self, job, out):
        import ants
        self.ants = ants
        self.fixed, self.moving = ants.image_read(job["fixed"]), ants.image_read(job["moving"])
        mask = ants.image_read(job["mask"]) if job["mask"] else None
        kind = "SyNOnly" if job["deformable_only"] else "SyN"
        identity = {"initial_transform": "Identity"} if job["deformable_only"] else {}
        self.found = ants.registration(self.fixed, self.moving, kind, mask=mask, random_seed=1,
                                       outprefix=str(out / "ants_"), **identity)

    def convert(self, job, out):
        self.ants.image_write(self.found["warpedmovout"], str(out / "warped.nii.gz"))
        path = self.ants.apply_transforms(self.fixed, self.moving, self.found["fwdtransforms"], compose=str(out / "total_"))
        shutil.copy(path, out / "field.nii.gz")


class Greedy:
    def register(self, job, out):
        from picsl_greedy import Greedy3D
        self.greedy = Greedy3D()
        pair = f"-i {job['fixed']} {job['moving']}"
        mask = f"-gm {job['mask']}" if job["mask"] else ""
        start = ""
        if not job["deformable_only"]:
            self.greedy.execute(f"-d 3 -a -dof 6 -m NCC 2x2x2 {pair} -o {out}/rigid.mat -ia-image-centers -n 100x100x20")
            start = f"-it {out}/rigid.mat"
        self.greedy.execute(f"-d 3 -m NCC 2x2x2 {pair} {mask} {start} -o {out}/warp.nii.gz -n 100x100x50 -s 2vox 1vox")
        self.chain = f"-r {out}/warp.nii.gz" + (f" {out}/rigid.mat" if start else "")

    def convert(self, job, out):
        self.greedy.execute(f"-d 3 -rf {job['fixed']} -rm {job['moving']} {out}/warped.nii.gz {self.chain}")
        self.greedy.execute(f"-d 3 -rf {job['fixed']} -rc {out}/field.nii.gz {self.chain}")


TOOLS = {"elastix": Elastix, "itk-elastix": ItkElastix, "plastimatch": Plastimatch, "antspyx": Ants, "greedy": Greedy}


def cpu_seconds():
    parts = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(p.ru_utime + p.ru_stime for p in parts)


def main():
    tool, job = TOOLS[sys.argv[1]](), json.loads(Path(sys.argv[2]).read_text())
    out = Path(job["out"])
    wall, cpu = time.time(), cpu_seconds()
    tool.register(job, out)
    cost = {"wall_s": time.time() - wall, "cpu_s": cpu_seconds() - cpu}
    cost["memory_mib"] = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)) / 1024
    tool.convert(job, out)
    (out / "cost.json").write_text(json.dumps(cost))


if __name__ == "__main__":
    main()
