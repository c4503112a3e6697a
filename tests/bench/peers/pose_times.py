#!/usr/bin/env python3
"""Times `kinevox pose` as a whole process beside other people's tools that only apply a ready-made field of the same pose.

  pose_times.py MODEL --scan NAME --work DIR [--kinevox build/bin/kinevox] [--repeats 5]

Writes the template, the field of the pose (`kinevox field --level 0`, not timed) and each tool's image as uncompressed .mha into
DIR. Prints a table: the least wall and CPU seconds of all repeats, peak memory, and how far the tool's image is from Kinevox's
(mean, in per cent of the intensity range). Tools that are not installed are left out: apt-get install elastix plastimatch
"""
import argparse
import array
import json
import shutil
from pathlib import Path

from apart import timed

TRANSFORM = """(Transform "DeformationFieldTransform")
(DeformationFieldFileName "{field}")
(DeformationFieldInterpolationOrder 1)
(NumberOfParameters 0)
(InitialTransformParametersFileName "NoInitialTransform")
(HowToCombineTransforms "Compose")
(FixedImageDimension 3)
(MovingImageDimension 3)
(FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(Size {DimSize})
(Index 0 0 0)
(Spacing {ElementSpacing})
(Origin {Offset})
(Direction {TransformMatrix})
(UseDirectionCosines "true")
(ResampleInterpolator "FinalBSplineInterpolator")
(FinalBSplineInterpolationOrder 1)
(Resampler "DefaultResampler")
(DefaultPixelValue 0)
(ResultImageFormat "mha")
(ResultImagePixelType "float")
(CompressResultImage "false")
"""
TYPES = {"MET_FLOAT": "f", "MET_SHORT": "h", "MET_USHORT": "H", "MET_UCHAR": "B"}


def run(command):
    """Wall seconds, CPU seconds and peak MiB of a command."""
    cost = timed(command)[1]
    return cost["wall_s"], cost["cpu_s"], cost["memory_mib"]


def least(command, repeats):
    costs = [run(command) for _ in range(repeats)]
    return [min(cost[i] for cost in costs) for i in range(3)]


def header_of(path):
    """The words of an .mha header, and where the voxels start."""
    words, start = {}, 0
    with open(path, "rb") as file:
        for line in file:
            start += len(line)
            name, value = line.decode("latin-1").split("=", 1)
            words[name.strip()] = value.strip()
            if name.strip() == "ElementDataFile":
                return words, start


def voxels_of(path):
    words, start = header_of(path)
    values = array.array(TYPES[words["ElementType"]])
    values.frombytes(Path(path).read_bytes()[start:])
    return values


def difference(a, b):
    """Mean, per cent of the range of `a`."""
    if len(a) != len(b):
        return float("nan")
    return 100 * sum(abs(x - y) for x, y in zip(a, b)) / len(a) / (max(a) - min(a))


def commands(options, work, template, field):
    """Name: command and the image that it writes."""
    words, _ = header_of(field)
    parameters = work / "transform.txt"
    parameters.write_text(TRANSFORM.format(field=field, **words))
    everything = {
        "kinevox pose": ([options.kinevox, "pose", options.model, "--scan", options.scan, "--quiet", "--out", work / "kinevox.mha"],
                         work / "kinevox.mha"),
        "plastimatch warp": (["plastimatch", "warp", "--input", template, "--output-img", work / "plastimatch.mha", "--xf", field],
                             work / "plastimatch.mha"),
        "transformix": (["transformix", "-in", template, "-out", work, "-tp", parameters], work / "result.mha"),
    }
    return {name: made for name, made in everything.items() if shutil.which(str(made[0][0]))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("--scan", required=True)
    parser.add_argument("--work", required=True, type=Path)
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    work = options.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    rest, template, field = work / "rest.json", work / "template.mha", work / "field.mha"
    rest.write_text(json.dumps({"joints": {}}))
    run([options.kinevox, "pose", options.model, "--pose", rest, "--quiet", "--out", template])
    run([options.kinevox, "field", options.model, "--scan", options.scan, "--level", "0", "--quiet", "--out", field])
    print("| | wall s | CPU s | peak MiB | mean difference % |\n| --- | --- | --- | --- | --- |")
    ours = None
    for name, (command, image) in commands(options, work, template, field).items():
        wall_s, cpu_s, peak_mib = least(command, options.repeats)
        ours = ours or voxels_of(image)
        print(f"| {name} | {wall_s:.2f} | {cpu_s:.2f} | {peak_mib:.0f} | {difference(ours, voxels_of(image)):.2f} |", flush=True)


if __name__ == "__main__":
    main()
