"""A small disk that can be filled: a tmpfs in a mount namespace of our own."""
import os
import subprocess
import sys

from service import arguments

MIB = 1 << 20


def may_mount():
    probe = "import tempfile, subprocess; f = tempfile.mkdtemp(); subprocess.check_call(['mount', '-t', 'tmpfs', 'none', f])"
    return subprocess.run(["unshare", "-rm", sys.executable, "-c", probe], stderr=subprocess.DEVNULL).returncode == 0


def mount(folder):
    folder.mkdir()
    subprocess.check_call(["mount", "-t", "tmpfs", "-o", "size=64m", "none", str(folder)])


def fill(folder, leave):
    """A file that takes all room but `leave` bytes."""
    space = os.statvfs(folder)
    size = space.f_bavail * space.f_frsize - leave
    with open(folder / "ballast", "wb") as file:
        os.posix_fallocate(file.fileno(), 0, max(1, size))


def run(description, inside):
    """What inside(options) returns in a namespace where it may mount."""
    options = arguments(description, inside="")
    if options.inside:
        return inside(options)
    if not may_mount():
        print("SKIPPED: this user may not mount a tmpfs in a namespace of its own (unshare -rm)")
        return 77
    return subprocess.run(["unshare", "-rm", sys.executable, *sys.argv, "--inside", "yes"]).returncode
