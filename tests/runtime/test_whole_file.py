"""Files that are written completely or not at all."""

from pathlib import Path

import pytest

from hardwall.model.runtime.whole_file import NotWrittenError, unfinished, whole_file, write_files


def test_a_file_appears_when_it_is_complete(tmp_path):
    path = tmp_path / "file.txt"
    path.write_text("old")
    with whole_file(path) as part:
        part.write_text("new")
        assert part.suffix == ".txt"
        assert unfinished == {part}
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]
    assert unfinished == set()


def test_a_link_stays_one_and_the_file_that_it_leads_to_is_written(tmp_path):
    target, link = tmp_path / "folder" / "target.txt", tmp_path / "link.txt"
    target.parent.mkdir()
    link.symlink_to("folder/target.txt")
    for text in ("of a link to nothing", "of a link to a file"):
        with whole_file(link) as part:
            part.write_text(text)
        assert link.is_symlink()
        assert target.read_text() == text
    assert list(target.parent.iterdir()) == [target]


def test_a_file_that_fails_leaves_the_old_one(tmp_path):
    path = tmp_path / "file.txt"
    path.write_text("old")
    message = r"file\.txt: cannot be written \(No space left on device\)$"
    with pytest.raises(OSError, match=message) as failure, whole_file(path):
        raise OSError(28, "No space left on device")
    assert failure.value.strerror == "No space left on device"
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_longest_name_can_be_written(tmp_path):
    path = tmp_path / f"{'n' * 251}.txt"
    with whole_file(path) as part:
        part.write_text("text")
    assert path.read_text() == "text"


OLD = {"a.txt": "old a", "other.txt": "other"}
NEW = {"a.txt": "new a", "b.txt": "new b\n", "c.txt": "ünew"}


@pytest.fixture
def folder(tmp_path) -> Path:
    """Return a folder with files of before."""
    for name, text in OLD.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def texts(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.is_file()}


def test_several_files_are_written_together(folder):
    assert write_files(folder, NEW) == tuple(folder / name for name in NEW)
    assert texts(folder) == OLD | NEW
    assert (folder / "b.txt").read_bytes() == b"new b\n"
    assert unfinished == set()


@pytest.mark.parametrize("last", NEW)
def test_a_full_disk_leaves_what_was_there_before(folder, monkeypatch, last):
    def write(path: Path, text: str, **options: str) -> int:
        if text == NEW[last]:
            raise OSError(28, "No space left on device")
        return path.write_bytes(text.encode())

    monkeypatch.setattr(Path, "write_text", write)
    with pytest.raises(NotWrittenError) as failure:
        write_files(folder, NEW)
    assert str(failure.value) == f"{folder / last}: cannot be written (No space left on device)"
    assert texts(folder) == OLD
    assert unfinished == set()


@pytest.mark.parametrize("name", NEW)
def test_a_folder_with_the_name_of_a_file_leaves_what_was_there_before(folder, name):
    (folder / name).unlink(missing_ok=True)
    (folder / name).mkdir()
    before = texts(folder)
    with pytest.raises(NotWrittenError) as failure:
        write_files(folder, NEW)
    assert str(failure.value) == f"{folder / name}: cannot be written (Is a directory)"
    assert texts(folder) == before
