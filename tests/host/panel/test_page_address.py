"""The address of the page in a real browser: the same when the panel starts again at its port, until it is renewed."""

import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from support.browser_tests import browsers_or_skip
from support.processes import HARDWALL, ended, line, started, wait_until

browsers = browsers_or_skip()


@pytest.fixture
def serving(board, tmp_path):
    """Serves the page of a board of the model, always at the same port."""
    with socket.create_server(("127.0.0.1", 0)) as found:
        port = found.getsockname()[1]

    @contextmanager
    def serve(*words: str) -> Iterator[str]:
        command = HARDWALL, "panel", board.name, "--http", port, *words
        with started(*command, XDG_STATE_HOME=str(tmp_path)) as process:
            yield line(process).removeprefix("page: ")
            process.send_signal(signal.SIGINT)
            ended(process)

    return serve


def test_who_reloads_the_page_after_a_restart_gets_in_again(serving, chromium):
    with serving() as url:
        tab = browsers.Tab(chromium, url)
        tab.arm()
        tab.page.locator(".access summary").click()
        about = tab.page.locator(".access p").inner_text()
        assert ".token, which only your user can read" in about
        assert "--new-token" in about
        assert "another user of this computer can take the port" in about
    wait_until(lambda: tab.state == "NO PANEL")
    with serving() as again:
        assert again == url
        # A tab that was left open comes back by itself, and the board is not armed by that.
        wait_until(lambda: tab.state == "DISARMED")
        tab.page.reload()
        wait_until(lambda: tab.page.locator("#head").count() and tab.state == "DISARMED")
        tab.page.wait_for_timeout(1000)
        assert tab.state == "DISARMED"
        tab.arm()
    with serving("--new-token") as renewed:
        assert renewed != url
        assert tab.page.goto(url).status == 403
        other = browsers.Tab(chromium, renewed)
        assert other.state == "DISARMED"
        assert other.errors == []
        other.page.context.close()
    assert tab.errors == []
    tab.page.context.close()


def test_a_page_at_any_port_says_that_its_address_ends(tab):
    tab.page.locator(".access summary").click()
    assert "This address ends with this program" in tab.page.locator(".access p").inner_text()
