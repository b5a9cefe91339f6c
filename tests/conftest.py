"""Settings of the whole suite: one seed, logged; the marker of tests that run in the simulator; the recordings."""

import gc
import inspect
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).absolute().parent.parent
SEED = os.environ.setdefault("HARDWALL_SEED", "1")
SAMPLES = os.environ.get("HARDWALL_SAMPLES", "the default number of")
# The workers share the cores already: linear algebra that takes all of them for a small matrix waits for them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Look for garbage as seldom as the program does; give Hypothesis its settings, and a seed unless it has one."""
    # Every simulator loads this file, and has no use for either.
    from hypothesis import settings  # noqa: PLC0415

    from hardwall.cli.app import COLLECTED  # noqa: PLC0415

    gc.set_threshold(*COLLECTED)
    # The first example of a kernel includes its compilation, and every failure must come again with the same seed.
    settings.register_profile("hardwall", deadline=None, database=None, print_blob=True)
    settings.load_profile("hardwall")
    if config.getoption("--hypothesis-seed") is None:
        config.option.hypothesis_seed = SEED


def pytest_report_header() -> str:
    return f"HARDWALL_SEED={SEED}, {SAMPLES} samples a random campaign"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests that call `simulate` as `rtl`, and run them first, because they take longest."""
    for item in items:
        code = getattr(inspect.unwrap(item.obj), "__code__", None)
        if code and "simulate" in code.co_names:
            item.add_marker("rtl")
    items.sort(key=lambda item: item.get_closest_marker("rtl") is None)


def pytest_collection_finish() -> None:
    """Leave all that was collected to itself: a search for garbage need not go through it."""
    gc.freeze()


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Return the folder of recordings of real encoders, which are not part of the project; skip where it is absent."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the recordings, ../shared/data, are not here")
    return folder


@pytest.fixture(scope="session")
def distributions(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return the sdist and the wheel of the tree, which are built once for all workers."""
    from support import environments, once  # noqa: PLC0415

    dist = once.once(tmp_path_factory, "built", environments.built) / "dist"
    return next(dist.glob("*.tar.gz")), next(dist.glob("*.whl"))


@pytest.fixture
def fresh(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Send results to an empty folder, which is made for those that have one; compiled files stay where they are."""
    monkeypatch.setattr("hardwall.sim.jobs.store.build_dir", lambda: request.getfixturevalue("tmp_path") / "build")
