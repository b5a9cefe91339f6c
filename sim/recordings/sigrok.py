"""Sessions of sigrok and PulseView, `.sr`: a ZIP with a file `metadata` and the samples of the channels in pieces.

The metadata is an INI file. Its section of a device has `capturefile`, `samplerate`, `unitsize` (bytes a sample) and
`probe1=NAME` and so on. Channel n is bit n - 1 of a sample, little-endian. The samples are in `CAPTUREFILE-1`,
`CAPTUREFILE-2` and so on, or in `CAPTUREFILE` alone.
"""

import configparser
import re
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from .capture import Capture, Changes, changed, hertz_of
from .error import RecordingError, readable

PIECE = 1 << 20
UNIT_MAX = 8
"""The most bytes of a sample."""
METADATA_MAX = 10**6
"""The most bytes of the metadata, which are in memory."""


class Sigrok(Capture):
    """A session.

    Args:
        name: the file, for messages.
        path: the file.

    Raises:
        RecordingError: if it is no session, or has no channels.
    """

    form = "sigrok session"

    def __init__(self, name: str, path: str | Path):
        self.name, self._path = name, path
        device = self._device()
        rate = hertz_of(device.get("samplerate", ""))
        unit = device.get("unitsize", "1")
        if rate is None:
            raise RecordingError(f"{name}: its metadata must have a samplerate, such as 1 MHz")
        if not unit.isdigit() or not 1 <= int(unit) <= UNIT_MAX:
            raise RecordingError(f"{name}: its metadata must have a unitsize of 1 to {UNIT_MAX}, not {unit[:20]!r}")
        self._rate, self._unit, self._file = rate, int(unit), device.get("capturefile", "logic-1")
        probes = {int(key[5:]): text for key, text in device.items() if re.fullmatch(r"probe[1-9]\d?", key)}
        self._bits = sorted(number - 1 for number in probes if number <= 8 * self._unit)
        self.channels = [probes[bit + 1] for bit in self._bits]

    def _device(self) -> dict[str, str]:
        """Return the section of the first device with logic channels."""
        config = configparser.ConfigParser(interpolation=None, strict=False)
        with readable(self.name, "a session of sigrok"), zipfile.ZipFile(self._path) as archive:
            if archive.getinfo("metadata").file_size > METADATA_MAX:
                raise RecordingError(f"{self.name}: its metadata must have at most {METADATA_MAX} bytes")
            text = archive.read("metadata").decode()
        try:
            config.read_string(text)
        except configparser.Error:
            raise RecordingError(f"{self.name}: has no metadata of sigrok that can be read") from None
        for section in config.sections():
            if config.has_option(section, "capturefile"):
                return dict(config[section])
        raise RecordingError(f"{self.name}: has no logic channels: capture A and B as digital channels")

    def changes(self, places: Sequence[int]) -> Changes:
        ticks: list[np.ndarray] = []
        levels: list[np.ndarray] = []
        start = before = None
        total = found = 0
        for samples in self._samples():
            now = np.zeros(len(samples), np.uint8)
            for bit, place in enumerate(places):
                now |= ((samples >> np.uint64(self._bits[place])) & np.uint64(1)).astype(np.uint8) << np.uint8(bit)
            if before is None:
                start = before = int(now[0])
            at = changed(before, now)
            ticks.append(total + at)
            levels.append(now[at])
            before, total, found = int(now[-1]), total + len(now), found + len(at)
            self.check_number(found)
        if total < 2:
            raise RecordingError(f"{self.name}: must have at least 2 samples, not {total}")
        return Changes(self._rate, np.concatenate(ticks), np.concatenate(levels).astype(np.int64), start, total - 1)

    def _samples(self) -> Iterator[np.ndarray]:
        """Yield the samples in pieces, as words."""
        rest = b""
        with readable(self.name, "a session of sigrok"), zipfile.ZipFile(self._path) as archive:
            for member in self._members(archive):
                with archive.open(member) as file:
                    while piece := file.read(PIECE):
                        piece = rest + piece
                        whole = len(piece) // self._unit * self._unit
                        rest = piece[whole:]
                        if whole:
                            yield self._words(piece[:whole])

    def _members(self, archive: zipfile.ZipFile) -> list[str]:
        numbered = {}
        for member in archive.namelist():
            match = re.fullmatch(rf"{re.escape(self._file)}(?:-(\d+))?", member)
            if match:
                numbered[int(match[1] or 0)] = member
        return [numbered[number] for number in sorted(numbered)]

    def _words(self, piece: bytes) -> np.ndarray:
        octets = np.frombuffer(piece, np.uint8).reshape(-1, self._unit)
        words = np.zeros(len(octets), np.uint64)
        for place in range(self._unit):
            words |= octets[:, place].astype(np.uint64) << np.uint64(8 * place)
        return words
