"""What is handed out: wheel, sdist, Verilog of scenes, bitstreams, pages, licences of packages, and the sums of all.

Two runs on the same commit with the same packages give the same bytes. Every file has the commit's time and no owner.
"""

import hashlib
import importlib.metadata
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterable
from pathlib import Path

from . import environments
from .archives import ROOT, normalise
from .processes import HARDWALL

RELEASE = ROOT / "build" / "release"
BUILTIN = sorted((ROOT / "sim/scene/builtin").glob("*.toml"))
SCENES = [path.stem for path in BUILTIN if "[[axis]]" not in path.read_text(encoding="utf-8")]
"""The scenes of one axis: `hardwall verilog` takes no others."""
EXTRAS = "host", "panel", "sim", "synth", "testing"
SUMS, LICENCES = "SHA256SUMS", "LICENCES.txt"


def made(
    folder: Path,
    scenes: Iterable[str],
    boards: Iterable[str],
    with_pages: bool,
    extras: Iterable[str] = EXTRAS,
    distributions: Iterable[Path] = (),
) -> list[Path]:
    """Make a release in an empty folder; return its files.

    Args:
        folder: the folder.
        scenes: the names of the scenes whose Verilog it has.
        boards: the boards whose bitstreams it has, with their reports and their wiring.
        with_pages: whether it has the pages.
        extras: the extras whose packages' licences it lists; they must be installed.
        distributions: the sdist and the wheel, where they are built already.
    """
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        sdist, wheel = distributions or environments.built(work)
        for path in (sdist, wheel):
            shutil.copy(path, folder)
        stem = sdist.name.removesuffix(".tar.gz")
        for task, names, kind in (("verilog", scenes, "verilog"), ("board", boards, "boards")):
            tree = work / f"{stem}-{kind}"
            for each in names:
                _run(HARDWALL, task, each, "--output-folder", tree / each)
            if tree.exists():
                _pack(tree, folder)
        if with_pages:
            sphinx = sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--doctree-dir", work / "doctrees"
            _run(*sphinx, "docs", work / f"{stem}-pages")
            (work / f"{stem}-pages" / ".buildinfo").unlink(missing_ok=True)
            _pack(work / f"{stem}-pages", folder)
    (folder / LICENCES).write_text(licences(extras), encoding="utf-8")
    files = sorted(folder.iterdir())
    sums = "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files)
    (folder / SUMS).write_text(sums, encoding="utf-8")
    return [*files, folder / SUMS]


def _run(*command: object) -> None:
    settings = os.environ | {"PYTHONHASHSEED": "0"}
    done = subprocess.run(list(map(str, command)), cwd=ROOT, env=settings, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[0]}: {done.stdout}{done.stderr}")


def _pack(tree: Path, folder: Path) -> None:
    """Pack a folder into an archive of its name."""
    archive = folder / f"{tree.name}.tar.gz"
    with tarfile.open(archive, "w") as tar:
        tar.add(tree, tree.name)
    normalise(archive)


def licences(extras: Iterable[str]) -> str:
    """Return the packages that some extras install, each with its version and what it says of its licence."""
    lines = [
        f"hardwall {importlib.metadata.version('hardwall')}: MIT; what its extras ({', '.join(extras)}) install:",
        "",
    ]
    for name in environments.needed(*extras):
        metadata = importlib.metadata.metadata(name)
        classified = [
            each.rpartition(" :: ")[2] for each in metadata.get_all("Classifier") or [] if "License ::" in each
        ]
        stated = (
            metadata.get("License-Expression"),
            " and ".join(classified),
            metadata.get("License", "").partition("\n")[0],
        )
        said = next(filter(None, stated), "see its files")
        lines.append(f"{name} {metadata['Version']}: {said}")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Make the whole release, with the bitstreams of the boards that are named, and print its files."""
    shutil.rmtree(RELEASE, ignore_errors=True)
    RELEASE.mkdir(parents=True)
    for path in made(RELEASE, SCENES, sys.argv[1:], with_pages=True):
        print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
