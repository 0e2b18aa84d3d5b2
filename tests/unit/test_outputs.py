"""Files that a person names: nobody's is replaced unasked, and none is left half written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from hil.files.outputs import (
    Output,
    OutputError,
    OutputExistsError,
    check_distinct,
    check_output,
    free_folder,
    overwrite_file,
    replace_file,
    write_output,
)

posix = pytest.mark.skipif(os.name != "posix", reason="links, pipes and process ids as POSIX has them")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_what_exists_is_refused_and_stays(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"old")
    with pytest.raises(OutputExistsError, match="--overwrite"):
        check_output(path)
    with pytest.raises(OutputExistsError, match="--overwrite"):
        Output(path)
    with pytest.raises(OutputExistsError, match="--overwrite"):
        write_output(path, b"new")
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["x"]


@posix
def test_a_link_is_somebody_s_file_too(tmp_path: Path) -> None:
    (tmp_path / "target").write_bytes(b"old")
    for name, to in (("link", "target"), ("dangling", "nowhere")):
        (tmp_path / name).symlink_to(tmp_path / to)
        with pytest.raises(OutputExistsError):
            check_output(tmp_path / name)
        with pytest.raises(OutputExistsError):
            write_output(tmp_path / name, b"new")
    assert (tmp_path / "target").read_bytes() == b"old"
    assert not (tmp_path / "nowhere").exists()
    write_output(tmp_path / "link", b"new", overwrite=True)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_bytes() == b"new"


def test_what_may_be_replaced_is_as_it_was_until_the_new_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"old")
    output = Output(path, overwrite=True)
    output.file.write(b"ne")
    output.file.flush()
    assert path.read_bytes() == b"old"
    output.file.write(b"w")
    output.finish()
    assert path.read_bytes() == b"new"
    assert names(tmp_path) == ["x"]


def test_what_was_to_replace_another_and_is_not_whole_stays_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(b"old")
    for name in ("x.unfinished.mcap", "x.unfinished-2.mcap"):
        given_up = Output(path, overwrite=True)
        given_up.file.write(b"half")
        given_up.file.flush()
        assert (tmp_path / name).read_bytes() == b"half", "where a program that is killed leaves it"
        assert given_up.leave() == tmp_path / name
    empty = Output(path, overwrite=True)
    assert empty.leave() is None
    gone = Output(path, overwrite=True)
    gone.file.write(b"x")
    gone.discard()
    whole = Output(path, overwrite=True)
    whole.file.write(b"new")
    whole.finish()
    assert path.read_bytes() == b"new"
    assert names(tmp_path) == ["x.mcap", "x.unfinished-2.mcap", "x.unfinished.mcap"]


def test_what_is_left_or_discarded_of_a_new_file(tmp_path: Path) -> None:
    left = Output(tmp_path / "a" / "left")
    left.file.write(b"half")
    assert left.leave() == tmp_path / "a" / "left"
    assert (tmp_path / "a" / "left").read_bytes() == b"half", "a log that is cut is worth keeping"
    gone = Output(tmp_path / "gone")
    gone.file.write(b"x")
    gone.discard()
    assert names(tmp_path) == ["a"]


@posix
def test_what_is_no_regular_file_is_written_as_it_is() -> None:
    null = Path("/dev/null")
    write_output(null, b"x")
    Output(null).finish()
    replace_file(null, b"x")
    check_output(null)
    check_distinct(null, null)


def test_folders_that_can_t_be_made_are_told_before_anything_is_begun(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OutputError, match="is no folder"):
        check_output(tmp_path / "file" / "x")
    with pytest.raises(OutputExistsError, match="is a folder"):
        check_output(tmp_path)
    check_output(tmp_path / "new" / "newer" / "x")
    assert names(tmp_path) == ["file"], "nothing was made"


def test_two_outputs_are_not_one_file(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="the same"):
        check_distinct(tmp_path / "x", None, tmp_path / "y" / ".." / "x")
    check_distinct(tmp_path / "x", tmp_path / "y")


@posix
def test_what_a_killed_program_has_left_goes_when_the_same_file_is_saved_again(tmp_path: Path) -> None:
    dead, mine = 2**22 + 1, os.getpid()  # more than there are
    for name in (f".x.{dead}.part", f".y.{dead}.part", f".x.{mine}0.part.txt", f".x.{os.getppid()}.part"):
        (tmp_path / name).write_bytes(b"left")
    replace_file(tmp_path / "x", b"new")
    assert names(tmp_path) == sorted([f".x.{os.getppid()}.part", f".x.{mine}0.part.txt", f".y.{dead}.part", "x"])


def test_a_failed_save_leaves_nothing_of_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("hil.files.outputs.Output.finish", full)
    with pytest.raises(OSError, match="No space"):
        write_output(tmp_path / "x", b"new")
    assert names(tmp_path) == []


@pytest.mark.parametrize("text", [b"longer than it was", b"short"])
def test_a_text_is_written_over_another_in_its_place(tmp_path: Path, text: bytes) -> None:
    (tmp_path / "x").write_bytes(b"as it was")
    overwrite_file(tmp_path / "x", text)
    assert (tmp_path / "x").read_bytes() == text


def test_a_text_that_does_not_fit_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    (tmp_path / "x").write_bytes(b"as it was")
    monkeypatch.setattr("hil.files.outputs.os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        overwrite_file(tmp_path / "x", b"longer than it was")
    assert (tmp_path / "x").read_bytes() == b"as it was"


@pytest.mark.parametrize("overwrite", [False, True])
def test_what_is_written_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, overwrite: bool) -> None:
    synced: list[int] = []
    monkeypatch.setattr("hil.files.outputs.os.fsync", lambda number: synced.append(os.fstat(number).st_size))
    write_output(tmp_path / "x", b"new", overwrite=overwrite)
    assert synced == [3], "all of it, before it is said to be there"


def test_a_folder_gets_the_first_free_number(tmp_path: Path) -> None:
    assert free_folder(tmp_path / "r") == tmp_path / "r"
    (tmp_path / "r").mkdir()
    (tmp_path / "r-2").write_bytes(b"")
    assert free_folder(tmp_path / "r") == tmp_path / "r-3"
