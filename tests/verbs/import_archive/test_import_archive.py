"""`gear.import_archive`: what comes in, and what does not."""

from __future__ import annotations

import gzip
import io
import shutil
import stat
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.cli.main import main
from gear.values.errors import DatasetError
from gear.verbs.import_archive import members
from gear.verbs.import_archive.run import ImportReport, import_archive


@pytest.fixture
def root(collected: Any) -> Path:
    return Path(collected("depth", "random", samples=2, patch="random"))


def packed(
    root: Path, out: Path, mode: str = "w", name: str = "data", then: Callable[[Any], None] | None = None
) -> Path:
    with tarfile.open(out, mode) as archive:  # type: ignore[call-overload]
        archive.add(root, name)
        if then is not None:
            then(archive)
    return out


def tree(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def member(name: str, data: bytes = b"x", **fields: Any) -> Callable[[Any], None]:
    def add(archive: Any) -> None:
        info = tarfile.TarInfo(name)
        info.size = len(data)
        for key, value in fields.items():
            setattr(info, key, value)
        archive.addfile(info, io.BytesIO(data) if info.isreg() else None)

    return add


def nothing_left(folder: Path) -> bool:
    return not (folder / "new").exists() and not list(folder.glob(".new*"))


@pytest.mark.parametrize(
    ("suffix", "mode"), [("tar", "w"), ("tar.gz", "w:gz"), ("tar.bz2", "w:bz2"), ("tar.xz", "w:xz")]
)
@pytest.mark.parametrize("name", [".", "some/data"])
def test_what_was_packed_comes_out(root: Path, tmp_path: Path, suffix: str, mode: str, name: str) -> None:
    archive = packed(root, tmp_path / f"a.{suffix}", mode, name)
    seen: list[tuple[int, int]] = []
    report = import_archive(archive, out=tmp_path / "new", on_progress=lambda *now: seen.append(now))
    wanted = tree(root)
    assert tree(tmp_path / "new") == {path: wanted[path] for path in tree(tmp_path / "new")}
    assert set(wanted) - set(tree(tmp_path / "new")) == set(report.left_out)
    assert seen[-1] == (len(wanted), len(wanted)) and report.files == len(tree(tmp_path / "new"))
    assert len(gear.open_dataset(tmp_path / "new")) == 2
    assert gear.verify(tmp_path / "new").is_whole


def test_zip_archives_too_and_by_the_command(root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.make_archive(str(tmp_path / "a"), "zip", root)
    assert main(["import", str(tmp_path / "a.zip"), "--out", str(tmp_path / "new")]) == 0
    assert "all as they were written" in capsys.readouterr().out
    assert gear.verify(tmp_path / "new").is_whole
    assert main(["import", str(tmp_path / "a.zip"), "--out", str(tmp_path / "new")]) == 2
    assert "is not empty" in capsys.readouterr().err


def test_strangers_files_are_left_out(root: Path, tmp_path: Path) -> None:
    def add(archive: Any) -> None:
        for name in ("data/evil.sh", "data/hooks/post", "data/gear/x.py", "elsewhere"):
            member(name)(archive)

    report = import_archive(packed(root, tmp_path / "a.tar", then=add), out=tmp_path / "new")
    assert set(report.left_out) >= {"evil.sh", "hooks/post", "gear/x.py", "elsewhere"}
    assert "left out" in report.summary()
    assert not {"evil.sh", "hooks/post", "gear/x.py", "elsewhere"} & set(tree(tmp_path / "new"))
    assert not (tmp_path / "new/hooks").exists()


def test_files_of_a_killed_run_do_not_come_in(root: Path, tmp_path: Path) -> None:
    hidden = tmp_path / ".new.gear-import"
    (hidden / "gear/scratch").mkdir(parents=True)
    (hidden / "setup.py").write_text("of a killed run")
    report = import_archive(packed(root, tmp_path / "a.tar"), out=tmp_path / "new")
    assert not (tmp_path / "new/setup.py").exists() and not (tmp_path / "new/gear/scratch").exists()
    assert report.files == len(tree(tmp_path / "new"))


@pytest.mark.parametrize(
    ("add", "problem"),
    [
        (member("../victim"), "is not a path inside"),
        (member("/victim"), "is not a path inside"),
        (member("data/..\\\\victim"), "is not a path inside"),
        (member("data/link", b"", type=tarfile.SYMTYPE, linkname="/etc"), "is a link"),
        (member("data/link", b"", type=tarfile.LNKTYPE, linkname="data/README.md"), "is a link"),
        (member("data/pipe", b"", type=tarfile.FIFOTYPE), "a device, a pipe"),
        (member("data/tty", b"", type=tarfile.CHRTYPE), "a device, a pipe"),
        (member("data/README.md"), "twice"),
        (member("data//README.md"), "twice"),
        (member("./data/./README.md"), "twice"),
        (member("data2/gear/test/plan.json", b"{}"), "holds 2 datasets"),
    ],
)
def test_hostile_members_refuse_the_archive(root: Path, tmp_path: Path, add: Any, problem: str) -> None:
    archive = packed(root, tmp_path / "a.tar", then=add)
    with pytest.raises(DatasetError, match=problem):
        import_archive(archive, out=tmp_path / "new")
    assert nothing_left(tmp_path)


def test_links_and_ciphers_in_zip_archives(root: Path, tmp_path: Path) -> None:
    shutil.make_archive(str(tmp_path / "a"), "zip", root)
    with zipfile.ZipFile(tmp_path / "a.zip", "a") as archive:
        link = zipfile.ZipInfo("link")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc")
    with pytest.raises(DatasetError, match="is a link"):
        import_archive(tmp_path / "a.zip", out=tmp_path / "new")
    assert nothing_left(tmp_path)


def test_archives_that_unpack_to_too_much(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(members, "ALWAYS_BYTES", 1_000_000)
    zeros = member("data/zeros", bytes(60_000_000))
    archive = packed(root, tmp_path / "a.tar.gz", "w:gz", then=zeros)
    monkeypatch.setattr(members, "LARGEST_RATIO", 10)
    with pytest.raises(DatasetError, match="unpacks to more than"):
        import_archive(archive, out=tmp_path / "new")
    assert nothing_left(tmp_path)


@pytest.mark.parametrize("kind", ["pax comments", "folders", "zip folders"])
def test_headers_without_files_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    monkeypatch.setattr(members, "ALWAYS_BYTES", 100_000)
    monkeypatch.setattr(members, "LARGEST_RATIO", 2)
    monkeypatch.setattr(members, "MOST_MEMBERS", 20_000_000 if kind == "pax comments" else 50)
    path = tmp_path / "a.tgz"
    if kind == "zip folders":
        with zipfile.ZipFile(path, "w") as archive:
            for number in range(60):
                archive.writestr(f"{number}/", b"")
    else:
        header = {"comment": "x" * 10_000} if kind == "pax comments" else {}
        with tarfile.open(path, "w:gz", format=tarfile.PAX_FORMAT) as tar:
            for number in range(60):
                member(str(number), b"", type=tarfile.DIRTYPE, pax_headers=header)(tar)
    with pytest.raises(DatasetError, match=r"more than 0 MB when decompressed|more than 50 members"):
        import_archive(path, out=tmp_path / "new")


def test_a_name_that_is_no_text_is_one_line(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("éa", b"")  # its name is stored in UTF-8
    data = (tmp_path / "a.zip").read_bytes().replace("é".encode(), b"\xff\xfe")
    (tmp_path / "a.zip").write_bytes(data)
    with pytest.raises(DatasetError, match="cannot be unpacked") as caught:
        import_archive(tmp_path / "a.zip", out=tmp_path / "new")
    assert "\n" not in str(caught.value)


def test_the_summary_is_safe_to_print() -> None:
    report = ImportReport(root=Path("new"), splits=("a\x1b[2J",), files=1, left_out=("b\n\x1b[2J",))
    assert report.summary().count("\n") == 1 and "\x1b" not in report.summary()


def test_a_header_that_demands_the_memory(tmp_path: Path) -> None:
    info = tarfile.TarInfo("x")
    info.type, info.size = tarfile.XHDTYPE, 1 << 32  # an extended header of 4 GB
    (tmp_path / "a.tar").write_bytes(info.tobuf() + bytes(2048))
    with pytest.raises(DatasetError, match="cannot be unpacked: a header is too long"):
        import_archive(tmp_path / "a.tar", out=tmp_path / "new")


def zipped(root: Path, out: Path, then: Callable[[zipfile.ZipFile], None] = lambda archive: None) -> bytes:
    shutil.make_archive(str(out.with_suffix("")), "zip", root)
    with zipfile.ZipFile(out, "a") as archive:
        then(archive)
    return out.read_bytes()


def changed(data: bytes, place: int, value: bytes) -> bytes:
    return data[:place] + value + data[place + len(value) :]


def test_archives_that_are_cut_off_or_go_on_are_refused(root: Path, tmp_path: Path) -> None:
    tar = packed(root, tmp_path / "a.tar").read_bytes()
    whole = gzip.compress(tar, 1)
    archive = zipped(root, tmp_path / "a.zip")
    stripped = tar.rstrip(b"\0")
    unended = stripped + bytes(-len(stripped) % 512)
    kinds = {
        "tar without its end": (unended, "its end is missing"),
        "data after the tar": (tar + b"more", "other data follow"),
        "two tars": (tar + tar, "other data follow"),
        "gzip without its checksum": (whole[:-8], "ended before"),
        "gzip with a wrong checksum": (changed(whole, len(whole) - 8, b"abcd"), "CRC check failed"),
        "data after the gzip": (whole + b"more", "Not a gzipped file"),
        "zip without its end": (archive[:-22], "its end is missing"),
        "zip cut in its end": (archive[:-2], "its end is missing"),
        "data after the zip": (archive + b"more", "other data follow"),
        "data before the zip": (b"#!/bin/sh\n" + archive, "cannot be unpacked"),
        "zip behind a tar": (tar + archive, "other data follow"),
        "zip with a wrong checksum": (changed(archive, archive.rindex(b"PK\1\2") + 16, b"abcd"), "Bad CRC-32"),
    }
    for name, (data, problem) in kinds.items():
        (tmp_path / "damaged").write_bytes(data)
        with pytest.raises(DatasetError, match=problem):
            import_archive(tmp_path / "damaged", out=tmp_path / "new")
        assert nothing_left(tmp_path), name


def test_zeros_after_a_tar_are_bounded(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tar = packed(root, tmp_path / "a.tar").read_bytes()
    monkeypatch.setattr(members, "ALWAYS_BYTES", len(tar))
    monkeypatch.setattr(members, "LARGEST_RATIO", 1)
    (tmp_path / "bomb").write_bytes(gzip.compress(tar + bytes(3_000_000), 1))
    with pytest.raises(DatasetError, match=r"more than . MB when decompressed"):
        import_archive(tmp_path / "bomb", out=tmp_path / "new")
    assert nothing_left(tmp_path)


def test_a_zip_in_a_tar_is_a_file(root: Path, tmp_path: Path) -> None:
    inner = zipped(root, tmp_path / "a.zip")
    archive = packed(root, tmp_path / "a.tar", then=member("data/copy.zip", inner))
    assert import_archive(archive, out=tmp_path / "new").left_out == ("copy.zip",)


@pytest.mark.parametrize(
    ("mode", "problem"), [(stat.S_IFLNK, "a link"), (stat.S_IFIFO, "a device or a pipe"), (stat.S_IFCHR, "a device")]
)
@pytest.mark.parametrize("name", ["odd", "odd/"])
def test_odd_kinds_in_zip_archives(root: Path, tmp_path: Path, mode: int, problem: str, name: str) -> None:
    info = zipfile.ZipInfo(name)
    info.external_attr = (mode | 0o644) << 16
    zipped(root, tmp_path / "a.zip", lambda archive: archive.writestr(info, b""))
    with pytest.raises(DatasetError, match=f"'odd', which is {problem}"):
        import_archive(tmp_path / "a.zip", out=tmp_path / "new")
    assert nothing_left(tmp_path)


def test_damaged_headers_are_one_line(root: Path, tmp_path: Path) -> None:
    header = tarfile.TarInfo("x")
    header.type, header.size = tarfile.XHDTYPE, 10
    block = header.tobuf(tarfile.USTAR_FORMAT) + b"10 a=bcde\n".ljust(512, b"\0")
    tar = packed(root, tmp_path / "a.tar").read_bytes()
    archive = zipped(root, tmp_path / "a.zip")
    digits = tarfile.TarInfo("x")
    digits.type, digits.size = tarfile.XHDTYPE, 5008
    kinds = [
        block * 3000 + tar,  # headers of headers
        digits.tobuf(tarfile.USTAR_FORMAT) + (b"9" * 5000 + b" path=x\n").ljust(5120, b"\0") + tar,
        changed(archive, len(archive) - 6, (1 << 31).to_bytes(4, "little")),  # the directory begins before the file
    ]
    for data in kinds:
        (tmp_path / "damaged").write_bytes(data)
        with pytest.raises(DatasetError, match="a header is damaged"):
            import_archive(tmp_path / "damaged", out=tmp_path / "new")
        assert nothing_left(tmp_path)


def test_a_negative_size_is_refused(root: Path, tmp_path: Path) -> None:
    info = member("odd", b"", pax_headers={"size": "-512"})
    archive = tmp_path / "a.tar"
    with tarfile.open(archive, "w", format=tarfile.PAX_FORMAT) as tar:
        tar.add(root, "data")
        info(tar)
    with pytest.raises(DatasetError, match="negative size"):
        import_archive(archive, out=tmp_path / "new")
    assert nothing_left(tmp_path)


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("data/readme.MD", "one file on some file systems"),
        ("data/README.md/x", "which is a file, too"),
        ("data/a\n\x1b[2J", "control characters"),
        ("d/" * 500 + "x", "folders deep"),
        ("x" * 300, "more than 255 bytes"),
    ],
)
def test_names_that_could_mislead(root: Path, tmp_path: Path, name: str, problem: str) -> None:
    archive = packed(root, tmp_path / "a.tar", then=member(name))
    with pytest.raises(DatasetError, match=problem):
        import_archive(archive, out=tmp_path / "new")
    assert nothing_left(tmp_path)


def test_damage_is_one_line_and_leaves_nothing(root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = packed(root, tmp_path / "a.tar")
    picture = next(path for path in root.rglob("rgb_0001.png") if "leftImg8bit" in path.parts)
    data, place = whole.read_bytes(), whole.read_bytes().find(picture.read_bytes()) + 300
    (tmp_path / "flipped.tar").write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
    (tmp_path / "cut.tar").write_bytes(data[: len(data) // 2])
    (tmp_path / "cut.tar.gz").write_bytes(gzip.compress(data)[:-2000])
    (tmp_path / "text").write_text("no archive")
    (tmp_path / "empty").write_bytes(b"")
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("a.txt", "a")
    for name in ("flipped.tar", "cut.tar", "cut.tar.gz", "text", "empty", "other.zip", "missing", "."):
        assert main(["import", str(tmp_path / name), "--out", str(tmp_path / "new")]) == 2, name
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and said.startswith("gear: "), said
        assert nothing_left(tmp_path)
    assert main(["import", str(tmp_path / "flipped.tar"), "--out", str(tmp_path / "new")]) == 2
    assert "rgb_0001.png is damaged" in capsys.readouterr().err
