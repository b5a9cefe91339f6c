"""The token of a page: kept for a port where only its user has it, and new wherever anybody else may have it."""

import os
import stat
from pathlib import Path

import pytest

from hardwall.host.panel.tokens import FORM, is_of_this_machine, kept_token, new_token


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch) -> Path:
    """The user's folder for the state of programs, which is not there yet."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state"


def test_a_token_is_new_and_has_128_bits():
    first, second = new_token(), new_token()
    assert first.text != second.text
    assert first.file is None
    assert all(FORM.fullmatch(each.text) for each in (first, second))


def test_a_port_has_the_same_token_again_and_another_port_another_one(state):
    first = kept_token(8080)
    assert kept_token(8080) == first
    assert first.file == state / "hardwall" / "panel-8080.token"
    assert first.note == ""
    assert kept_token(8081).text != first.text


def test_what_is_kept_is_its_user_s_alone_whatever_the_umask_is(state):
    before = os.umask(0)
    try:
        file = kept_token(8080).file
    finally:
        os.umask(before)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
    assert [each.name for each in file.parent.iterdir()] == ["panel-8080.token"]


def test_a_renewed_token_is_another_one_and_stays():
    first = kept_token(8080)
    second = kept_token(8080, renew=True)
    assert second.text != first.text
    assert kept_token(8080) == second


def broken(file: Path, way: str, tmp_path: Path) -> None:
    """Make of a file with a token one that is not to be believed."""
    text = file.read_text()
    if way == "readable by others":
        file.chmod(0o640)
    elif way == "writable by others":
        file.chmod(0o602)
    elif way == "of another user":
        os.chown(file, 65534, 65534)
    elif way == "a link":
        (tmp_path / "there").write_text(text)
        (tmp_path / "there").chmod(0o600)
        file.unlink()
        file.symlink_to(tmp_path / "there")
    elif way == "a pipe":
        file.unlink()
        os.mkfifo(file, 0o600)
    else:
        file.write_text(
            {"empty": "", "short": text[:10], "long": text.strip() * 2, "no text": "\udcff" * 22}[way],
            errors="surrogateescape",
        )


@pytest.mark.parametrize(
    "way",
    [
        *("readable by others", "writable by others", "of another user", "a link", "a pipe"),
        *("empty", "short", "long", "no text"),
    ],
)
def test_a_file_that_others_may_have_is_not_believed(way, tmp_path):
    if way == "of another user" and os.geteuid():
        pytest.skip("only root gives files away")
    first = kept_token(8080)
    broken(first.file, way, tmp_path)
    second = kept_token(8080)
    assert second.text != first.text
    assert second.note == f"{first.file} was no token of yours alone: the page has a new address"
    assert stat.S_IMODE(second.file.lstat().st_mode) == 0o600
    assert not second.file.is_symlink()
    assert kept_token(8080) == second._replace(note="")


def test_a_folder_that_others_may_write_to_keeps_nothing(state):
    (state / "hardwall").mkdir(parents=True)
    (state / "hardwall").chmod(0o777)
    found = kept_token(8080)
    assert found.file is None
    assert found.note == f"its address is not kept: others may write to {state / 'hardwall'}"
    assert list((state / "hardwall").iterdir()) == []


def test_a_folder_that_cannot_be_had_is_no_error(state):
    state.write_text("a file")
    found = kept_token(8080)
    assert found.file is None
    assert found.note == "its address is not kept: Not a directory"


def test_a_user_without_a_home_gets_a_token_of_this_start(monkeypatch):
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setenv("XDG_STATE_HOME", "not/absolute")
    monkeypatch.setattr(Path, "home", homeless)
    assert kept_token(8080).note == "its address is not kept: Could not determine home directory."


@pytest.mark.parametrize(
    ("address", "so"),
    [("127.0.0.1", True), ("127.0.0.2", True), ("::1", True), ("0.0.0.0", False), ("::", False), ("10.0.0.1", False)],
)
def test_only_the_loopback_is_this_machine_alone(address, so):
    assert is_of_this_machine(address) == so
