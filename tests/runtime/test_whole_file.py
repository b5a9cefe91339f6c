"""Files that are written completely or not at all."""

import pytest

from hardwall.model.runtime.whole_file import unfinished, whole_file


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
