"""Folders that a user names: whole or not at all, written again, and never over what somebody else has put there."""

import os
from pathlib import Path

import pytest

from hardwall.sim.jobs.named_folder import foreign, write_folder
from hardwall.sim.jobs.whole_folder import LIST


def fill(folder: Path, text: str = "bits") -> None:
    """Make the content of the folder."""
    (folder / "top.bit").write_text(text)
    (folder / "report.txt").write_text("fmax")


def content(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir() if path.name != LIST}


WHOLE = {"top.bit": "bits", "report.txt": "fmax"}


@pytest.mark.parametrize("before", ["absent", "empty", "written", "one file less"])
def test_a_folder_that_may_be_written(before, tmp_path):
    folder = tmp_path / "above" / "out"
    if before == "empty":
        folder.mkdir(parents=True)
    elif before != "absent":
        write_folder(folder, lambda made: fill(made, "older bits"))
    if before == "one file less":
        (folder / "top.bit").unlink()
    assert foreign(folder) is None
    write_folder(folder, fill)
    assert content(folder) == WHOLE
    assert list(folder.parent.iterdir()) == [folder]
    assert foreign(folder) is None


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda folder: (folder / "notes.txt").write_text("mine"), "notes.txt"),
        (lambda folder: (folder / "report.txt").write_text("changed"), "report.txt"),
        (lambda folder: (folder / "more").mkdir(), "more"),
        (lambda folder: (folder / LIST).unlink(), "report.txt"),
        (lambda folder: (folder / LIST).write_text("not a list"), LIST),
        (lambda folder: (folder / "link").symlink_to("nowhere"), "link"),
    ],
    ids=["more", "changed", "a folder", "no list", "another list", "a link"],
)
def test_what_somebody_else_has_put_there_is_found(change, found, tmp_path):
    folder = tmp_path / "out"
    write_folder(folder, fill)
    change(folder)
    assert foreign(folder) == found


def test_a_file_in_its_place_is_foreign(tmp_path):
    (tmp_path / "out").write_text("mine")
    assert foreign(tmp_path / "out") == "out"


def test_what_fails_leaves_the_folder_as_it_was(tmp_path):
    folder = tmp_path / "out"
    write_folder(folder, fill)

    def fail(made: Path) -> None:
        fill(made, "half")
        raise RuntimeError("the tool failed")

    with pytest.raises(RuntimeError, match=r"^the tool failed$"):
        write_folder(folder, fail)
    assert content(folder) == WHOLE
    assert list(tmp_path.iterdir()) == [folder]


def test_a_folder_that_cannot_be_put_in_place_leaves_the_older_one(tmp_path, monkeypatch):
    folder = tmp_path / "out"
    write_folder(folder, fill)
    rename = Path.rename

    def refuse(self, target):
        if self.name == "made":
            raise OSError("no room")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(OSError, match="no room"):
        write_folder(folder, lambda made: fill(made, "newer"))
    monkeypatch.undo()
    assert content(folder) == WHOLE
    assert list(tmp_path.iterdir()) == [folder]


def test_a_link_to_a_folder_stays_one(tmp_path):
    (tmp_path / "real").mkdir()
    link = tmp_path / "out"
    link.symlink_to("real")
    write_folder(link, fill)
    assert os.readlink(link) == "real"
    assert content(tmp_path / "real") == WHOLE


def test_folders_of_others_beside_it_are_left_alone(tmp_path):
    (tmp_path / "building-plans").mkdir()
    (tmp_path / "building-plans" / "lock").write_text("mine")
    write_folder(tmp_path / "out", fill)
    assert (tmp_path / "building-plans" / "lock").read_text() == "mine"
