"""scripts/wheels.py without building a wheel: what it refuses, and that its packages are what they are said to be."""
import hashlib
import os
import shutil
import tarfile
import zipfile
from pathlib import Path

import pytest

import eixo

platforms = pytest.importorskip("platforms", reason="scripts/ is not there")
wheels = pytest.importorskip("wheels")


def test_a_library_that_asks_for_a_newer_glibc_is_refused(tmp_path, monkeypatch, capsys):
    if not shutil.which("objdump"):
        pytest.skip("no objdump (apt-get install binutils)")
    # The library out of an FMU that the program of these tests exports: whatever it was linked against.
    library = wheels.fmu_binary(eixo.program(), tmp_path)
    asked = platforms.glibc(library)
    assert (2, 2) <= asked < (3, 0)
    said = ".".join(map(str, asked))
    monkeypatch.setattr(wheels, "OLD", asked)
    wheels.ask_of_glibc("the FMU's library", library)
    assert capsys.readouterr().out == f"the FMU's library: runs with glibc {said} and later\n"
    monkeypatch.setattr(wheels, "OLD", (asked[0], asked[1] - 1))
    with pytest.raises(SystemExit, match=f"FAILED: the FMU's library asks for glibc {said}"):
        wheels.ask_of_glibc("the FMU's library", library)


def test_what_manylinux2014_has_is_what_is_asked_for():
    assert wheels.OLD == (2, 17)


def test_windows_that_cannot_be_built_is_said_and_fails_where_it_was_asked_for(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(platforms, "windows_lacks", lambda: "no target (rustup target add it)")
    assert wheels.main(["--platforms", "win64", "--out", str(tmp_path / "out")]) == 1
    assert "SKIPPED: win64: no target (rustup target add it); there will be no Windows wheel" in capsys.readouterr().out
    assert not (tmp_path / "out").exists()
    for wrong in (["--platforms", "beos"], ["--platforms", "win64", "--check"]):
        with pytest.raises(SystemExit) as caught:
            wheels.main(wrong)
        assert caught.value.code == 2


def test_the_program_alone_is_packed_the_same_each_time(tmp_path):
    program = tmp_path / "eixo"
    program.write_bytes(b"#!/bin/sh\necho packed\n")
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    one = wheels.pack(program, "eixo-1.2.3-linux-x86_64", tmp_path / "one")
    os.utime(program, (1, 1))
    two = wheels.pack(program, "eixo-1.2.3-linux-x86_64", tmp_path / "two")
    assert [p.name for p in one] == ["eixo-1.2.3-linux-x86_64.tar.xz", "eixo-1.2.3-linux-x86_64.zip"]
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in two]
    with tarfile.open(one[0]) as packed:
        assert [(m.name.split("/")[1], oct(m.mode)) for m in packed] == [("eixo", "0o755"), ("LICENSE", "0o644"), ("README.md", "0o644")]
        packed.extractall(tmp_path / "tar", filter="data")
    unpacked = tmp_path / "tar/eixo-1.2.3-linux-x86_64"
    assert platforms.run(unpacked / "eixo") == "packed\n"
    assert (unpacked / "LICENSE").read_bytes() == (wheels.ROOT / "LICENSE").read_bytes()
    with zipfile.ZipFile(one[1]) as packed:
        assert packed.testzip() is None
        assert packed.getinfo("eixo-1.2.3-linux-x86_64/eixo").external_attr >> 16 == 0o100755
    sums = wheels.checksums(one, tmp_path / "one").read_text().splitlines()
    assert sums == [f"{hashlib.sha256(p.read_bytes()).hexdigest()}  {p.name}" for p in one]
    if shutil.which("sha256sum"):
        assert platforms.run("sha256sum", "--check", "SHA256SUMS", cwd=tmp_path / "one").count(": OK") == 2


def test_the_program_of_a_wheel_is_found(tmp_path):
    wheel = tmp_path / "eixo-1.2.3-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("eixo/__init__.py", "")
        archive.writestr("eixo-1.2.3.data/scripts/eixo", "#!/bin/sh\necho wheel\n")
    program, version = wheels.program_of(wheel, tmp_path)
    assert version == "1.2.3" and Path(program).name == "eixo" and platforms.run(program) == "wheel\n"
