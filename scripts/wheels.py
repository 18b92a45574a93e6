"""Builds the wheels of eixo (`pip install eixo`) and packs the program alone, all from the sources here.

    python3 scripts/wheels.py [--check] [--platforms linux64,win64] [--out target/wheels]

A wheel holds the program and the Python module that calls it. linux64 is built by maturin with zig against glibc 2.17
(manylinux2014), the FMU's library inside the program too: both are read with objdump, and the wheel with auditwheel. win64 needs
rustup's target x86_64-pc-windows-gnu and Debian's gcc-mingw-w64-x86-64-posix; without --platforms it is left out aloud where they
are missing, with it that is an error. Where both can be built, each program exports FMUs for both.

Beside the wheels stand the program alone, as .tar.xz and .zip, and SHA256SUMS of all of them. --check installs the linux64 wheel in
a new environment with FMPy, runs the module's tests there with the program of the wheel, and executes python/notebook. maturin, zig
and auditwheel come from PyPI into an environment of their own. Exit code 1 when something fails.
"""

import argparse
import hashlib
import io
import lzma
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import venv
import zipfile
from pathlib import Path

import platforms
from platforms import OLD_GLIBC, ROOT, WINDOWS, run, skip

TOOLS = ["maturin==1.16.0", "ziglang==0.13.0", "auditwheel==6.8.2"]
# What a reader of the notebook has beside eixo.
BESIDE = ["FMPy==0.3.32", "nbclient==0.11.0", "ipykernel==7.4.0", "matplotlib==3.11.2", "pytest==9.2.0"]
LINUX = "x86_64-unknown-linux-gnu"
# By platform: what its files are called, the tag of its wheel, the program's name.
PLATFORMS = {
    "linux64": ("linux-x86_64", "manylinux_2_17_x86_64.manylinux2014_x86_64", "eixo"),
    "win64": ("windows-x86_64", "win_amd64", "eixo.exe"),
}
OLD = tuple(map(int, OLD_GLIBC.split(".")))
# The earliest time that a zip file can tell: packages of the same sources are the same bytes.
EPOCH = (1980, 1, 1, 0, 0, 0)


def environment_of(folder, packages):
    """A new virtual environment with these packages, or the one there that was made with them; its interpreter."""
    python, made = folder / "bin" / "python", folder / "packages"
    wanted = "\n".join(map(str, packages))
    if not made.is_file() or made.read_text() != wanted:
        shutil.rmtree(folder, ignore_errors=True)
        venv.create(folder, with_pip=True)
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *packages)
        made.write_text(wanted)
    return python


def build(platform, others, tools, out):
    """Builds the wheel of a platform; its path."""
    environment = dict(os.environ, PATH=f"{tools.parent}{os.pathsep}{os.environ['PATH']}")
    environment["EIXO_LINKER_LINUX64"] = platforms.old_linker(platforms.zig(tools), out)
    if others:
        environment["EIXO_PLATFORMS"] = ",".join(others)
    command = [tools.parent / "maturin", "build", "--release", "--locked", "--target", LINUX if platform == "linux64" else WINDOWS]
    if platform == "linux64":
        command += ["--zig", "--compatibility", "manylinux2014"]
    with tempfile.TemporaryDirectory(dir=out) as folder:
        run(*command, "--out", folder, cwd=ROOT, env=environment)
        (made,) = Path(folder).glob("*.whl")
        return Path(shutil.move(made, out / made.name))


def program_of(wheel, folder):
    """Unpacks the program of a wheel into a folder; its path, and the wheel's version."""
    _, version, *_ = wheel.name.split("-")
    with zipfile.ZipFile(wheel) as archive:
        (entry,) = [e for e in archive.namelist() if f"eixo-{version}.data/scripts/eixo" in e]
        program = folder / Path(entry).name
        program.write_bytes(archive.read(entry))
    program.chmod(0o755)
    return program, version


def ask_of_glibc(what, library):
    """Prints the glibc that a program or library asks for; fails when that is newer than a manylinux2014 system's."""
    asked = platforms.glibc(library)
    if asked > OLD:
        raise SystemExit(f"FAILED: {what} asks for glibc {'.'.join(map(str, asked))}; manylinux2014 has {OLD_GLIBC}")
    print(f"{what}: runs with glibc {'.'.join(map(str, asked))} and later", flush=True)


def fmu_binary(program, folder):
    """The FMU's library for linux64, out of an FMU that the program exports."""
    run(program, "export", folder / "axis.fmu")
    with zipfile.ZipFile(folder / "axis.fmu") as fmu:
        return fmu.extract("binaries/linux64/eixo.so", folder)


def look_at(platform, wheel, program, tools):
    """What a wheel says it is, it is."""
    tag = PLATFORMS[platform][1]
    # The names of one platform stand in no order that the format promises.
    if set(tag.split(".")) != set(wheel.stem.rsplit("-", 1)[1].split(".")):
        raise SystemExit(f"FAILED: {wheel.name} is no wheel for {tag}")
    if platform != "linux64":
        skip(f"running {program.name}: this is no Windows; its wheel was built, not tested")
        return
    ask_of_glibc("the program", program)
    with tempfile.TemporaryDirectory() as folder:
        ask_of_glibc("the FMU's library", fmu_binary(program, Path(folder)))
    said = run(tools.parent / "auditwheel", "show", wheel)
    if '"manylinux_2_17_x86_64"' not in said and '"manylinux_2_12_x86_64"' not in said and '"manylinux_2_5_x86_64"' not in said:
        raise SystemExit(f"FAILED: auditwheel: {said}")
    print(f"auditwheel: {' '.join(said.split())}", flush=True)


def pack(program, name, out):
    """The program alone with licence and manual, as .tar.xz and .zip; their paths. The same bytes whenever it is done."""
    files = [(program.name, program, 0o755), ("LICENSE", ROOT / "LICENSE", 0o644), ("README.md", ROOT / "README.md", 0o644)]
    tar, archive = out / f"{name}.tar.xz", out / f"{name}.zip"
    with lzma.open(tar, "wb", preset=9) as compressed, tarfile.open(fileobj=compressed, mode="w", format=tarfile.USTAR_FORMAT) as packed:
        for inside, file, mode in files:
            entry = tarfile.TarInfo(f"{name}/{inside}")
            entry.size, entry.mode = file.stat().st_size, mode
            packed.addfile(entry, io.BytesIO(file.read_bytes()))
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
        for inside, file, mode in files:
            entry = zipfile.ZipInfo(f"{name}/{inside}", EPOCH)
            entry.external_attr, entry.compress_type = (0o100000 | mode) << 16, zipfile.ZIP_DEFLATED
            entry.create_system = 3
            packed.writestr(entry, file.read_bytes())
    return [tar, archive]


def checksums(files, out):
    """Writes SHA256SUMS as `sha256sum --check` reads it; its path."""
    lines = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in sorted(files)]
    (out / "SHA256SUMS").write_text("".join(lines))
    return out / "SHA256SUMS"


def check(wheel, out):
    """Installs the wheel beside FMPy in a new environment, runs the module's tests there and executes the notebook."""
    shutil.rmtree(out / "clean", ignore_errors=True)
    began = time.monotonic()
    python = environment_of(out / "clean", [wheel, *BESIDE])
    print(f"check: installed in {time.monotonic() - began:.0f} s", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        # Nothing of this machine but the system's own programs; what IPython and matplotlib keep goes with the folder.
        environment = {"PATH": f"{python.parent}:/usr/bin:/bin", "HOME": folder, "MPLBACKEND": "agg", "LANG": "C.UTF-8"}
        where = {"cwd": folder, "env": environment}
        print("check:", run("eixo", "--version", **where).strip(), "from", run("which", "eixo", **where).strip(), flush=True)
        inside = run(python, "-c", "import eixo; print(eixo.program(), eixo.__file__)", **where).split()
        if not all(path.startswith(str(out / "clean")) for path in inside):
            raise SystemExit(f"FAILED: not what was installed: {inside}")
        began = time.monotonic()
        tests = run(python, "-m", "pytest", "--quiet", "-p", "no:cacheprovider", ROOT / "python/tests/test_module.py", **where)
        print(f"check: {tests.strip().splitlines()[-1]}", flush=True)
        for notebook in sorted((ROOT / "python" / "notebook").glob("*.ipynb")):
            began = time.monotonic()
            executed = out / notebook.name
            run(python, "-c", EXECUTE, notebook, executed, **where)
            print(f"check: {notebook.name} executed in {time.monotonic() - began:.0f} s: {executed}", flush=True)


EXECUTE = """
import sys, nbclient, nbformat
notebook = nbformat.read(sys.argv[1], 4)
nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
nbformat.write(notebook, sys.argv[2])
"""


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="install the linux64 wheel in a new environment and use it")
    parser.add_argument("--platforms", type=lambda t: t.split(","), help="these, which must be built; all that can be without")
    parser.add_argument("--out", type=Path, default=ROOT / "target" / "wheels", help="folder of the results")
    options = parser.parse_args(arguments)
    if unknown := set(options.platforms or []) - set(PLATFORMS):
        parser.error(f"no platform {', '.join(sorted(unknown))}; there are {', '.join(PLATFORMS)}")
    if options.check and "linux64" not in (options.platforms or PLATFORMS):
        parser.error("--check uses the linux64 wheel")
    if sys.platform != "linux" or os.uname().machine != "x86_64" or not shutil.which("cargo") or not shutil.which("objdump"):
        raise SystemExit("FAILED: wheels are built on Linux on x86-64 with cargo and objdump (apt-get install binutils)")
    wanted = options.platforms or list(PLATFORMS)
    if lacks := platforms.windows_lacks():
        skip(f"win64: {lacks}; there will be no Windows wheel")
        if "win64" in (options.platforms or []):
            return 1
    possible = [p for p in PLATFORMS if p != "win64" or not lacks]
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    tools, results = environment_of(out / "tools", TOOLS), []
    for platform in (p for p in wanted if p in possible):
        began = time.monotonic()
        wheel = build(platform, [p for p in possible if p != platform], tools, out)
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, built in {time.monotonic() - began:.0f} s", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            program, version = program_of(wheel, Path(folder))
            look_at(platform, wheel, program, tools)
            results += [wheel, *pack(program, f"eixo-{version}-{PLATFORMS[platform][0]}", out)]
        if options.check and platform == "linux64":
            check(wheel, out)
    print(checksums(results, out).read_text(), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
